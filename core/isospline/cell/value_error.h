// The error of f at a point, in double precision.
#pragma once

#include "isospline/cell/coefficients.h"

#include <algorithm>
#include <cmath>

namespace isospline {

/// A bound on the error of f - level at one point of one cell, and of the Bernstein coefficients and their subdivision
/// for a ray that begins there, given the largest magnitude of the cell's coefficients.
template <int Degree>
double value_error(double magnitude, double coordinate_error)
{
    constexpr double unit_roundoff = 0x1p-53;
    constexpr double polynomial = 128.0, evaluation = 80.0, subdivisions = 48.0 * 3 * Degree;
    constexpr double rounding = unit_roundoff * (polynomial + evaluation + subdivisions);
    return magnitude * (rounding + 2.0 * 6.0 * coordinate_error);
}

/// The same for a cell.
template <int Degree>
double value_error(const CellCoefficients& cell, double coordinate_error)
{
    double magnitude = 0.0;
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j)
            for (int i = 0; i <= Degree; ++i)
                magnitude = std::max(magnitude, std::abs(cell(i, j, k)));
    return value_error<Degree>(magnitude, coordinate_error);
}

} // namespace isospline
