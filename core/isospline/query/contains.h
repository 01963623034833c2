// Whether points are in the solid that an isosurface bounds.
#pragma once

#include "isospline/shell/isosurface.h"

#include <glm/vec3.hpp>

namespace isospline {

/// Whether a point, in world space, is in the solid: it is in the volume's domain, in no cell that the mask removes, in
/// all half-spaces of the clip, and f - level has the sign of Isosurface's Inside. A point where f equals the level, up
/// to the rounding errors of double precision, counts as above it. At a sample that the model interpolates, so
/// does one up to the rounding of the coefficients. A point on the border of the domain may be in the solid, also if it
/// is that of a sample which rounding puts beside the border; one of a half-space's plane is.
bool contains(const IsosurfaceSnapshot& surface, const glm::dvec3& position_world);

} // namespace isospline
