// The polynomial of one cell, evaluated in double precision.
#pragma once

#include "isospline/shell/shell.h"
#include "isospline/spline/basis.h"
#include "isospline/spline/volume.h"

#include <glm/vec3.hpp>

#include <cstddef>

namespace isospline {

/// One cell: f - level is the polynomial of these coefficients less the threshold.
struct CellBlock {
    CellBlock(const Volume& volume, double surface_threshold, const Cell& cell)
        : coefficients(volume.cell_coefficients(cell.x, cell.y, cell.z)), row_stride(volume.row_stride()),
          slice_stride(volume.slice_stride()), threshold(surface_threshold), lower(cell.x, cell.y, cell.z)
    {
    }

    const float* coefficients;
    std::ptrdiff_t row_stride, slice_stride;
    double threshold;
    glm::dvec3 lower; ///< corner of the cell, lattice space
};

/// f - level at local coordinates in [0, 1]^3 of a cell.
template <int Degree>
inline double value_in_cell(const CellBlock& cell, const glm::dvec3& local)
{
    const auto x = cell_weights<Degree>(local.x), y = cell_weights<Degree>(local.y), z = cell_weights<Degree>(local.z);
    double value = 0.0;
    for (int k = 0; k <= Degree; ++k) {
        double plane = 0.0;
        for (int j = 0; j <= Degree; ++j) {
            const float* row = cell.coefficients + j * cell.row_stride + k * cell.slice_stride;
            double line = 0.0;
            for (int i = 0; i <= Degree; ++i)
                line += x[i] * (static_cast<double>(row[i]) - cell.threshold);
            plane += y[j] * line;
        }
        value += z[k] * plane;
    }
    return value;
}

/// Gradient of f, by lattice coordinates, at local coordinates in [0, 1]^3 of a cell.
template <int Degree>
inline glm::dvec3 gradient_in_cell(const CellBlock& cell, const glm::dvec3& local)
{
    const auto x = cell_weights<Degree>(local.x), y = cell_weights<Degree>(local.y), z = cell_weights<Degree>(local.z);
    const auto dx = cell_derivatives<Degree>(local.x), dy = cell_derivatives<Degree>(local.y),
               dz = cell_derivatives<Degree>(local.z);
    glm::dvec3 gradient{0.0};
    for (int k = 0; k <= Degree; ++k) {
        // Of one plane: the value, and the derivatives by x and y.
        double plane = 0.0, plane_dx = 0.0, plane_dy = 0.0;
        for (int j = 0; j <= Degree; ++j) {
            const float* row = cell.coefficients + j * cell.row_stride + k * cell.slice_stride;
            double line = 0.0, line_dx = 0.0;
            for (int i = 0; i <= Degree; ++i) {
                const double coefficient = static_cast<double>(row[i]) - cell.threshold;
                line += x[i] * coefficient;
                line_dx += dx[i] * coefficient;
            }
            plane += y[j] * line;
            plane_dx += y[j] * line_dx;
            plane_dy += dy[j] * line;
        }
        gradient.x += z[k] * plane_dx;
        gradient.y += z[k] * plane_dy;
        gradient.z += dz[k] * plane;
    }
    return gradient;
}

} // namespace isospline
