// The extent of an isosurface, with its caps, along directions.
#pragma once

#include "isospline/math/box.h"
#include "isospline/shell/isosurface.h"

#include <glm/vec3.hpp>

#include <span>
#include <vector>

namespace isospline {

/// For each direction, the largest <direction, x> over the points of a surface that rays can hit, in lattice space. The
/// result is never too small, and too large by less than two cells; it is minus infinity if rays hit nothing.
///
/// A cap is a part of a plane. Its farthest point is on the surface, or is a corner of the part of the volume that the
/// clip keeps.
std::vector<double> reach_lattice(const IsosurfaceSnapshot& surface, std::span<const glm::dvec3> directions,
                                  const Progress& progress = {});

/// The box of the points of a surface that rays can hit, to about the size of a cell, in lattice space.
Box bounds_lattice(const IsosurfaceSnapshot& surface, const Progress& progress = {});

} // namespace isospline
