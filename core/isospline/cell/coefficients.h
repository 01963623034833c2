// The coefficients of one cell.
#pragma once

#include "isospline/spline/coefficient_view.h"
#include "isospline/spline/volume.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>

namespace isospline {

/// In the cell, f - level is the polynomial with these coefficients minus the threshold.
struct CellCoefficients : CoefficientView {
    /// `of_cell` are the coefficients of `cell`.
    CellCoefficients(const CoefficientView& of_cell, double surface_threshold, const glm::ivec3& cell)
        : CoefficientView(of_cell), threshold(surface_threshold), lower(cell)
    {
    }

    /// The coefficients (0, j, k), (1, j, k), ...
    const float* row(std::ptrdiff_t j, std::ptrdiff_t k) const { return first + j * row_stride + k * slice_stride; }
    /// One coefficient minus the threshold.
    double operator()(std::ptrdiff_t i, std::ptrdiff_t j, std::ptrdiff_t k) const
    {
        return static_cast<double>(row(j, k)[i]) - threshold;
    }

    double threshold;
    glm::dvec3 lower; ///< corner of the cell, lattice space
};

/// The coefficients of a cell of a volume of degree 0 to 3. It has a copy of them if the volume does not have them in
/// memory.
class VolumeCell : public CellCoefficients {
public:
    VolumeCell(const Volume& volume, double surface_threshold, const glm::ivec3& cell)
        : CellCoefficients({}, surface_threshold, cell)
    {
        static_cast<CoefficientView&>(*this) = volume.cell(cell, own_.data());
    }
    VolumeCell(const VolumeCell&) = delete;
    VolumeCell& operator=(const VolumeCell&) = delete;

private:
    std::array<float, 64> own_;
};

} // namespace isospline
