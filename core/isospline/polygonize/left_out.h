// The parts of a surface that a mesh leaves out.
#pragma once

#include "isospline/math/box.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/surface_mesh.h"

#include <glm/mat4x4.hpp>

#include <vector>

namespace isospline {

/// Joins boxes that touch. `boxes` and `mesh` are in lattice space.
std::vector<LeftOut> join_boxes(const std::vector<Box>& boxes, const LabeledMesh& mesh,
                                const glm::dmat4& lattice_to_world);

} // namespace isospline
