#include "isospline/query/solid.h"

#include "isospline/trace/point_side.h"

#include <optional>

namespace isospline {

namespace {

/// A kept cell that contains a sample, also on its border.
std::optional<glm::ivec3> kept_cell_with(const IsosurfaceSnapshot& surface, const glm::ivec3& sample)
{
    const auto [first, last] = surface.volume().cells_with(sample);
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
    return is_inside(side_in_cell(surface, lattice, 0.0, *cell), surface.inward_sign());
}

} // namespace

Mask samples_inside(const IsosurfaceSnapshot& surface, const Progress& progress)
{
    return make_mask(
        surface.volume().shape(), [&](const glm::ivec3& sample) { return is_inside(surface, sample); }, progress);
}

} // namespace isospline
