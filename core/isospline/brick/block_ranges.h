// Bounds of f in each block of a brick.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/spline/coefficient_view.h"

#include <array>

namespace isospline {

/// Bounds of f - offset in the blocks of a brick. Blocks beyond the brick's end have lower > upper.
struct BlockRanges {
    alignas(64) std::array<float, blocks_per_brick> lower, upper;
    float least, most; ///< the smallest and the largest coefficient of the brick
};

/// The range of a block is that of its coefficients after new knots at both ends of the block, along each axis (Boehm,
/// 1980): B-splines that reach beyond the block are cut there, and the range is as tight as that of one cell's
/// Bernstein coefficients at those ends. It is widened by the rounding errors. `degree` is 1 to 3.
BlockRanges block_ranges(const CoefficientView& coefficients, const Brick& brick, int degree);

} // namespace isospline
