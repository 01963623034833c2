#include "isospline/query/contains.h"

#include "isospline/math/affine.h"
#include "isospline/trace/point_side.h"

namespace isospline {

bool contains(const IsosurfaceSnapshot& surface, const glm::dvec3& position_world)
{
    const glm::dvec3 lattice = transform_point(surface.volume().world_to_lattice(), position_world);
    const double error = surface.coordinate_error();
    return is_in_domain(surface, lattice, 0.0) && is_in_clip(surface, lattice, error) &&
           is_inside(side_in_cell(surface, lattice, error, cell_at(surface, lattice)), surface.inward_sign());
}

} // namespace isospline
