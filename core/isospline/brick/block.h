// Blocks of 2 x 2 x 2 cells, and a slab in each cell that holds the surface.
#pragma once

#include "isospline/spline/coefficient_view.h"

#include <array>
#include <cstdint>

namespace isospline {

/// What rays need of a block to tell which of its cells they may cross the surface in. Cell i is the block's cell at
/// child_position(i).
///
/// In each cell, the surface is where lower <= <normal, local> <= upper, local being coordinates in [0, 1]^3;
/// components of normals are at most 31.
struct Block {
    static constexpr int capacity = 8;

    std::array<std::int8_t, capacity> slab_normal[3];
    std::array<std::int8_t, capacity> slab_lower, slab_upper;
    std::uint8_t cells = 0; ///< bit i: coefficients of cell i have both signs, and its slab leaves any of it
};

/// The block of which `cells` are in question, which must be in the volume. `first` are the coefficients of its first
/// cell, itself in question or not.
Block make_block(const CoefficientView& first, int degree, double threshold, unsigned cells);

} // namespace isospline
