#include "isospline/query/contains.h"

#include "isospline/math/affine.h"
#include "isospline/trace/point_side.h"

#include <glm/vector_relational.hpp>

namespace isospline {

bool contains(const IsosurfaceSnapshot& surface, const glm::dvec3& position_world)
{
    const glm::dmat4& map = surface.volume().world_to_lattice();
    const glm::dvec3 lattice = transform_point(map, position_world);
    const glm::dvec3 end(surface.volume().cell_shape());
    if (!glm::all(glm::greaterThanEqual(lattice, glm::dvec3(0.0))) || !glm::all(glm::lessThanEqual(lattice, end)))
        return false; // beyond the domain, by any distance
    const double error = coordinate_error(map, position_world);
    return is_in_clip(surface, lattice, error) && side_of(surface, lattice, error) == Side::inside;
}

} // namespace isospline
