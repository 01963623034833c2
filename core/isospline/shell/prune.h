// Voxel pruning: removes cells when a finer representation of the spline proves that they hold no surface.
#pragma once

#include "isospline/brick/brick.h"

#include <span>

namespace isospline {

class Volume;

/// Pruning of paper §5 with `depth` >= 1 levels of two-scale subdivision. `cells[i]` is a set of cells of the brick
/// `bricks[i]`. A cell stays if its (2^depth + n)^3 fine coefficients, minus the threshold, have both signs; zero
/// counts as positive. The degree n is 1, 2 or 3.
///
/// The fine coefficients are computed by recursion, as long as they can change the answer. A branch ends at a sub-cell
/// whose coefficients have one sign. A whole cell is decided if f has both signs at corners of its sub-cells. Branches
/// are processed side by side in SIMD lanes, in float32; cells that float32 cannot decide are processed again in
/// float64.
void prune(const Volume& volume, double threshold, int depth, std::span<const Brick> bricks,
           std::span<BrickCells> cells);

/// The same in float32 alone: a cell stays, too, if its fine coefficients may have both signs within their rounding. So
/// no rounding of a ray's polynomial can change its sign in a cell that is removed.
void prune_beyond_rounding(const Volume& volume, double threshold, int depth, std::span<const Brick> bricks,
                           std::span<BrickCells> cells);

} // namespace isospline
