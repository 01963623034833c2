#include "isospline/query/sample_mask.h"

#include "isospline/math/grid.h"
#include "isospline/trace/point_side.h"
#include "isospline/util/parallel.h"

#include <cstddef>
#include <optional>

namespace isospline {

namespace {

/// A kept cell that contains a sample, also on its border.
std::optional<glm::ivec3> kept_cell_with(const IsosurfaceSnapshot& surface, const glm::ivec3& sample)
{
    // For odd degrees, a sample is a corner of the cells before and after it.
    const glm::ivec3 first = glm::max(sample - surface.volume().degree() % 2, glm::ivec3(0));
    const glm::ivec3 last = glm::min(sample, surface.volume().cell_shape() - 1);
    for (int z = first.z; z <= last.z; ++z)
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x)
                if (surface.kept_cells().contains({x, y, z}))
                    return glm::ivec3(x, y, z);
    return std::nullopt;
}

bool is_inside(const IsosurfaceSnapshot& surface, const glm::ivec3& sample)
{
    const std::optional<glm::ivec3> cell = kept_cell_with(surface, sample);
    const glm::dvec3 lattice = glm::dvec3(sample) + surface.volume().lattice_shift(); // exact
    if (!cell || !is_in_clip(surface, lattice, surface.coordinate_error()))
        return false;
    const Side side = side_in_cell(surface, lattice, 0.0, *cell);
    return side == Side::inside || (side == Side::unknown && surface.inward_sign() > 0.0);
}

} // namespace

Mask samples_inside(const IsosurfaceSnapshot& surface, const Progress& progress)
{
    const glm::ivec3 shape = surface.volume().shape();
    Mask mask(static_cast<std::size_t>(place_count(shape)));
    parallel_for(
        static_cast<std::size_t>(shape.z), 1,
        [&](std::size_t begin, std::size_t end) {
            for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z)
                for (int y = 0; y < shape.y; ++y)
                    for (int x = 0; x < shape.x; ++x)
                        mask[static_cast<std::size_t>(place_in(shape, {x, y, z}))] = is_inside(surface, {x, y, z});
        },
        progress);
    return mask;
}

} // namespace isospline
