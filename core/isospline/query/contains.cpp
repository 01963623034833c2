#include "isospline/query/contains.h"

#include "isospline/cell/value-inl.h"
#include "isospline/math/affine.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/point_in_cell.h"

#include <glm/geometric.hpp>

namespace isospline {

bool contains(const IsosurfaceSnapshot& surface, const glm::dvec3& position_world)
{
    const Volume& volume = surface.volume();
    const IsosurfaceOptions& options = surface.options();
    for (const HalfSpace& half_space : options.clip)
        if (!(glm::dot(half_space.normal, position_world) >= half_space.offset))
            return false;

    const glm::dvec3 lattice = transform_point(volume.world_to_lattice(), position_world);
    const glm::dvec3 shape(volume.cell_shape());
    for (int axis = 0; axis < 3; ++axis)
        if (!(lattice[axis] >= 0.0 && lattice[axis] <= shape[axis]))
            return false;
    const PointInCell point(surface, lattice);
    if (!surface.kept_cells().contains(point.index))
        return false;

    const double value = dispatch_degree(
        volume.degree(), [&](auto degree) { return scalar::value_in_cell<degree>(point.cell, point.local); });
    return options.inside == Inside::above ? value > 0.0 : value < 0.0;
}

} // namespace isospline
