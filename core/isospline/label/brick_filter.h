// Separable symmetric filters of the numbers at voxels, with mirror boundaries.
#pragma once

#include "isospline/label/brick_field.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <array>
#include <vector>

namespace isospline {

/// The weights of a symmetric filter along x, y and z: of a voxel, and of its first, second, ... neighbours on a side.
using SeparableFilter = std::array<std::vector<float>, 3>;

/// Convolution with a Gaussian, cut off at three standard deviations, in voxels along x, y, z.
SeparableFilter gaussian_filter(const glm::dvec3& deviations);
/// 1 - (1 - G)^3 along each axis, G being the Gaussian; it keeps polynomials of degree 5.
SeparableFilter low_pass_filter(const glm::dvec3& deviations);
/// Samples to the coefficients of the B-spline of degree 2 that interpolates them.
SeparableFilter interpolation_filter();

/// Filters a field into another one with the same layout. The numbers of bricks that are not computed stay. `between`
/// is memory.
void apply(const SeparableFilter& filter, const BrickField& from, BrickField& to, BrickField& between,
           const Progress& progress = {});

} // namespace isospline
