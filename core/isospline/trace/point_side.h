// Where a point is with respect to the solid that an isosurface bounds: one decision for caps and queries of points.
#pragma once

#include "isospline/brick/side.h"
#include "isospline/shell/isosurface.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

namespace isospline {

/// The side of a point of a cell, in lattice space, before the solid is clipped. The errors of the point's coordinates
/// are up to `coordinate_error`. A point that is certainly not in the domain is outside, and so are all points of cells
/// that the mask removes.
Side side_of(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error,
             const glm::ivec3& cell);
/// The same in the cell that contains the point.
Side side_of(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error);

/// The cell on the inner side of a point on a half-space's plane.
glm::ivec3 inner_cell(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, const HalfSpace& half_space);

/// Whether a point of lattice space may be in all half-spaces of the clip.
bool is_in_clip(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error);

/// A bound on the errors of the coordinates of a mapped point.
double coordinate_error(const glm::dmat4& map, const glm::dvec3& point);

} // namespace isospline
