#include "isospline/polygonize/cells_in_question.h"

#include "isospline/math/grid.h"
#include "isospline/polygonize/special_cubes.h"

namespace isospline {

ChosenCells::ChosenCells(const std::vector<Box>& boxes, double margin, const glm::ivec3& cell_shape)
{
    for (const Box& box : boxes) {
        const glm::ivec3 first = glm::max(glm::ivec3(glm::floor(box.lower - margin)), 0);
        const glm::ivec3 last = glm::min(glm::ivec3(glm::floor(box.upper + margin)), cell_shape);
        glm::ivec3 brick;
        for (brick.z = first.z / brick_size * brick_size; brick.z <= last.z; brick.z += brick_size)
            for (brick.y = first.y / brick_size * brick_size; brick.y <= last.y; brick.y += brick_size)
                for (brick.x = first.x / brick_size * brick_size; brick.x <= last.x; brick.x += brick_size) {
                    BrickCells& cells = bricks_[crossing_key(brick, 0)];
                    const glm::ivec3 from = glm::max(first - brick, 0), to = glm::min(last - brick, brick_size - 1);
                    const std::uint64_t row = (std::uint64_t{2} << to.x) - (std::uint64_t{1} << from.x);
                    for (int z = from.z; z <= to.z; ++z)
                        for (int y = from.y; y <= to.y; ++y)
                            cells[static_cast<std::size_t>(z)] |= row << brick_size * y;
                }
    }
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
