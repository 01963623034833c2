// The cells in which a surface may be seen edge-on.
#pragma once

#include "isospline/shell/isosurface.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <vector>

namespace isospline {

/// The shell's cells that may have a point of the surface where a ray from `eye` is tangent to it. All other cells are
/// proven to have none: the products of the ranges of gradients and of rays have one sign. The eye is in homogeneous
/// lattice coordinates: (e, 1), or (-d, 0) for parallel rays along d.
std::vector<glm::ivec3> outline_cells(const IsosurfaceSnapshot& surface, const glm::dvec4& eye,
                                      const Progress& progress = {});

} // namespace isospline
