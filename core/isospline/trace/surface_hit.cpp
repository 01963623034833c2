#include "isospline/trace/surface_hit.h"

#include "isospline/math/affine.h"

#include <glm/geometric.hpp>

namespace isospline {

void set_surface_normal(Hit& hit, const glm::dvec3& gradient_lattice, Inside inside, const glm::dmat4& world_to_lattice)
{
    // Lattice coordinates are a function of world coordinates: the chain rule is the transpose of that map.
    const glm::dvec3 gradient = transform_gradient(world_to_lattice, gradient_lattice);
    const double magnitude = glm::length(gradient);
    const double outward = inside == Inside::above ? -1.0 : 1.0;
    hit.gradient_magnitude = magnitude;
    hit.normal = magnitude > 0.0 ? (outward / magnitude) * gradient : glm::dvec3(0.0);
}

} // namespace isospline
