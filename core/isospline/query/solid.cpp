#include "isospline/query/solid.h"

#include "isospline/math/affine.h"
#include "isospline/trace/point_side.h"

#include <optional>

namespace isospline {

namespace {

/// A kept cell that contains a point, also on its border.
std::optional<glm::ivec3> kept_cell_at(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice)
{
    const CellSet& kept = surface.kept_cells();
    if (kept.is_all())
        return cell_at(surface, lattice);
    const glm::ivec3 first = cell_at(surface, lattice - surface.coordinate_error());
    const glm::ivec3 last = cell_at(surface, lattice + surface.coordinate_error());
    for (int z = first.z; z <= last.z; ++z)
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x)
                if (kept.contains({x, y, z}))
                    return glm::ivec3(x, y, z);
    return std::nullopt;
}

/// Whether a point is in the domain. A sample on its border is, as for samples_inside(), although rounding may put it
/// beside the border.
bool is_in_domain_or_at_sample(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double error)
{
    return is_in_domain(surface, lattice, 0.0) ||
           (is_in_domain(surface, lattice, error) && is_at_sample(surface.volume(), lattice, error));
}

/// Whether a point in lattice space, whose coordinates have an error of up to `error`, is in the solid.
bool is_in_solid(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double error)
{
    if (!is_in_domain_or_at_sample(surface, lattice, error) ||
        !is_in_clip(surface, lattice, surface.coordinate_error()))
        return false;
    const std::optional<glm::ivec3> cell = kept_cell_at(surface, lattice);
    return cell && is_inside(side_on_plane(surface, lattice, error, *cell), surface.inward_sign());
}

} // namespace

bool contains(const IsosurfaceSnapshot& surface, const glm::dvec3& position_world)
{
    return is_in_solid(surface, transform_point(surface.volume().world_to_lattice(), position_world),
                       surface.coordinate_error());
}

Mask samples_inside(const IsosurfaceSnapshot& surface, const Progress& progress)
{
    return make_mask(
        surface.volume().shape(),
        [&](const glm::ivec3& sample) {
            return is_in_solid(surface, glm::dvec3(sample) + surface.volume().lattice_shift(), 0.0); // exact
        },
        progress);
}

} // namespace isospline
