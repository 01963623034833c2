// Coefficients of a box of a volume, where they are in memory.
#pragma once

#include <cstddef>

namespace isospline {

/// The coefficients that reach a box of cells, x fastest: the (n+1)^3 of its cell (x, y, z) begin at
/// first[x + y * row_stride + z * slice_stride]. As of Volume::cell_coefficients(), four floats may be read from the
/// beginning of every row.
struct CoefficientView {
    /// From a cell of the box on.
    CoefficientView from(int x, int y, int z) const
    {
        return {first + x + y * row_stride + z * slice_stride, row_stride, slice_stride};
    }

    const float* first;
    std::ptrdiff_t row_stride, slice_stride;
};

} // namespace isospline
