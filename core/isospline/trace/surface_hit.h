// From a root in a cell to a hit in world space.
#pragma once

#include "isospline/shell/isosurface.h"
#include "isospline/trace/hit.h"

#include <glm/mat4x4.hpp>

namespace isospline {

/// Fills in a hit's normal and gradient magnitude from the gradient of f by lattice coordinates. `world_to_lattice`
/// leads from the space of the hit's normal to lattice space. Where the gradient vanishes the normal is zero.
void set_surface_normal(Hit& hit, const glm::dvec3& gradient_lattice, Inside inside,
                        const glm::dmat4& world_to_lattice);

} // namespace isospline
