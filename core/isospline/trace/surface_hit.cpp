#include "isospline/trace/surface_hit.h"

#include "isospline/math/affine.h"
#include "isospline/trace/cell_block.h"

#include <glm/geometric.hpp>

namespace isospline {

void set_surface_normal(Hit& hit, const Isosurface& surface, const Cell& cell, const glm::dvec3& position_lattice,
                        const glm::dmat4& world_to_lattice)
{
    const CellBlock block(surface.volume(), surface.threshold(), cell);
    const glm::dvec3 local = position_lattice - block.lower;
    glm::dvec3 gradient_lattice{0.0};
    switch (surface.volume().degree()) {
    case 1:
        gradient_lattice = gradient_in_cell<1>(block, local);
        break;
    case 2:
        gradient_lattice = gradient_in_cell<2>(block, local);
        break;
    case 3:
        gradient_lattice = gradient_in_cell<3>(block, local);
        break;
    }

    // Lattice coordinates are a function of world coordinates: the chain rule is the transpose of that map.
    const glm::dvec3 gradient = transform_gradient(world_to_lattice, gradient_lattice);
    const double magnitude = glm::length(gradient);
    const double outward = surface.options().inside == Inside::above ? -1.0 : 1.0;
    hit.gradient_magnitude = magnitude;
    hit.normal = magnitude > 0.0 ? (outward / magnitude) * gradient : glm::dvec3(0.0);
}

} // namespace isospline
