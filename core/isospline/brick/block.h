// Blocks of 2 x 2 x 2 cells, and a slab in each cell that holds the surface.
#pragma once

#include "isospline/spline/coefficient_view.h"

#include <array>
#include <cstdint>

namespace isospline {

/// The data with which a ray finds the cells of a block in which it may cross the surface. Cell i is the block's cell
/// at child_position(i).
///
/// In each cell, the surface lies where lower <= <normal, local> <= upper. `local` are coordinates in [0, 1]^3, and the
/// components of normals are at most 31.
struct Block {
    static constexpr int capacity = 8;

    std::array<std::int8_t, capacity> slab_normal[3];
    std::array<std::int8_t, capacity> slab_lower, slab_upper;
    std::uint8_t cells = 0; ///< bit i: coefficients of cell i have both signs, and its slab is not empty
};

/// Makes a block from those of its cells that are in `cells`; these must be in the volume. `first` are the coefficients
/// of the block's first cell, which need not be in `cells`.
Block make_block(const CoefficientView& first, int degree, double threshold, unsigned cells);

} // namespace isospline
