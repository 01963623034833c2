#include "isospline/polygonize/cells_in_question.h"

#include "isospline/math/grid.h"
#include "isospline/polygonize/special_cubes.h"

namespace isospline {

std::unordered_set<CrossingKey> cubes_of(const std::vector<Box>& boxes, double steps, double margin)
{
    std::unordered_set<CrossingKey> cubes;
    for (const Box& box : boxes) {
        const glm::ivec3 first = glm::max(glm::ivec3(glm::floor(steps * (box.lower - margin))), 0);
        const glm::ivec3 last = glm::max(glm::ivec3(glm::floor(steps * (box.upper + margin))), 0);
        glm::ivec3 at;
        for (at.z = first.z; at.z <= last.z; ++at.z)
            for (at.y = first.y; at.y <= last.y; ++at.y)
                for (at.x = first.x; at.x <= last.x; ++at.x)
                    cubes.insert(crossing_key(at, 0));
    }
    return cubes;
}

std::vector<BrickInQuestion> bricks_in_question(const IsosurfaceSnapshot& surface)
{
    const BrickRanges& ranges = *surface.shared_ranges();
    const SpecialCubes cells(surface.planes(), 1);
    const bool above_is_solid = surface.options().inside == Inside::above;
    std::vector<BrickInQuestion> found;
    for (std::size_t index = 0; index < ranges.octets().size(); ++index)
        for (int child = 0; child < 8; ++child) {
            const BrickRanges::Range range = ranges.octets()[index].brick(static_cast<std::size_t>(child));
            if (range.lower > range.upper) // beyond the grid
                continue;
            const Brick brick =
                brick_at(surface.volume().cell_shape(), 2 * at_place(ranges.shape(), index) + child_position(child));
            const CubeKind kind = cells.kind_by_planes(brick.first, brick.size);
            if (kind == CubeKind::outside)
                continue;
            const bool is_mixed = range.straddles(surface.threshold());
            const bool may_be_solid =
                is_mixed || (static_cast<double>(range.lower) >= surface.threshold()) == above_is_solid;
            const bool may_have_caps = surface.planes().have_caps() && kind == CubeKind::special && may_be_solid;
            if (is_mixed || may_have_caps)
                found.push_back({brick, is_mixed, may_have_caps});
        }
    return found;
}

} // namespace isospline
