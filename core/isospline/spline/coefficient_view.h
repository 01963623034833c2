// Coefficients of a box of a volume.
#pragma once

#include <cstddef>
#include <memory>

namespace isospline {

/// The coefficients that influence a box of cells, x fastest. The (n+1)^3 coefficients of cell (x, y, z) begin at
/// first[x + y * row_stride + z * slice_stride]. Four floats may be read from the beginning of every row, as with
/// Volume::cell_coefficients().
struct CoefficientView {
    /// The view that begins at a cell of the box.
    CoefficientView from(int x, int y, int z) const
    {
        return {first + x + y * row_stride + z * slice_stride, row_stride, slice_stride};
    }

    const float* first;
    std::ptrdiff_t row_stride, slice_stride;
};

/// A view of a volume's memory, or of a copy that it owns.
struct CoefficientBox : CoefficientView {
    std::unique_ptr<float[]> copy;
    std::size_t copied_bytes = 0;
};

} // namespace isospline
