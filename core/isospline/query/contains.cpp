#include "isospline/query/contains.h"

#include "isospline/math/affine.h"
#include "isospline/trace/point_side.h"

#include <glm/common.hpp>

namespace isospline {

namespace {

/// Whether a point is in the domain. A sample on its border is, as for samples_inside(), although rounding may put it
/// beside the border.
bool is_in_domain_or_at_sample(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double error)
{
    return is_in_domain(surface, lattice, 0.0) ||
           (is_in_domain(surface, lattice, error) && is_at_sample(surface.volume(), lattice, error));
}

} // namespace

bool contains(const IsosurfaceSnapshot& surface, const glm::dvec3& position_world)
{
    const glm::dvec3 lattice = transform_point(surface.volume().world_to_lattice(), position_world);
    const double error = surface.coordinate_error();
    return is_in_domain_or_at_sample(surface, lattice, error) && is_in_clip(surface, lattice, error) &&
           is_inside(side_on_plane(surface, lattice, error, cell_at(surface, lattice)), surface.inward_sign());
}

} // namespace isospline
