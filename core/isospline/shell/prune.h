// Voxel pruning: cells that a finer representation of the spline shows to hold no surface.
#pragma once

#include "isospline/brick/brick.h"

#include <span>

namespace isospline {

class Volume;

/// Pruning of paper §5, down to `depth` >= 1 levels of two-scale subdivision: of each set `cells[i]`, of the brick
/// `bricks[i]`, those cells stay whose (2^depth + n)^3 fine coefficients, less the threshold, have both signs, zero
/// counting as positive. The degree n is 1, 2 or 3.
///
/// The fine coefficients are found by recursion, where it can still change the answer: a sub-cell with coefficients of
/// one sign ends a branch, and both signs of f at the corners of sub-cells settle the whole cell. Branches are worked
/// on side by side in SIMD lanes, in float32; cells that its rounding cannot decide are done again in float64.
void prune(const Volume& volume, double threshold, int depth, std::span<const Brick> bricks,
           std::span<BrickCells> cells);

} // namespace isospline
