// The coefficients of one cell.
#pragma once

#include "isospline/spline/coefficient_view.h"
#include "isospline/spline/volume.h"

#include <glm/vec3.hpp>

#include <cstddef>

namespace isospline {

/// In the cell, f - level is the polynomial of these coefficients less the threshold.
struct CellCoefficients : CoefficientView {
    /// `cell` has the coefficients `of_cell`.
    CellCoefficients(const CoefficientView& of_cell, double surface_threshold, const glm::ivec3& cell)
        : CoefficientView(of_cell), threshold(surface_threshold), lower(cell)
    {
    }

    CellCoefficients(const Volume& volume, double surface_threshold, const glm::ivec3& cell)
        : CellCoefficients(
              {volume.cell_coefficients(cell.x, cell.y, cell.z), volume.row_stride(), volume.slice_stride()},
              surface_threshold, cell)
    {
    }

    /// The coefficients (0, j, k), (1, j, k), ...
    const float* row(std::ptrdiff_t j, std::ptrdiff_t k) const { return first + j * row_stride + k * slice_stride; }
    /// One of them, less the threshold.
    double operator()(std::ptrdiff_t i, std::ptrdiff_t j, std::ptrdiff_t k) const
    {
        return static_cast<double>(row(j, k)[i]) - threshold;
    }

    double threshold;
    glm::dvec3 lower; ///< corner of the cell, lattice space
};

} // namespace isospline
