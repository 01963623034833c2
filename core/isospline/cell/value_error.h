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

/// The largest magnitude of a cell's coefficients minus the threshold.
template <int Degree>
double largest_magnitude(const CellCoefficients& cell)
{
    double magnitude = 0.0;
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j)
            for (int i = 0; i <= Degree; ++i)
                magnitude = std::max(magnitude, std::abs(cell(i, j, k)));
    return magnitude;
}

/// The same for a cell.
template <int Degree>
double value_error(const CellCoefficients& cell, double coordinate_error)
{
    return value_error<Degree>(largest_magnitude<Degree>(cell), coordinate_error);
}

/// How far f may be from a sample at its place, in a model that interpolates, given the largest magnitude of the
/// stored coefficients around it.
///
/// Numbers are rounded to float32 when they are read (twice) and after the filter of each axis. At the sample, the
/// model undoes the filters that follow a rounding, and its weights sum to one. So each of the five adds at most 2^-24
/// of the largest magnitude.
inline double sample_error(double magnitude)
{
    return 5.0 * 0x1p-24 * magnitude;
}

} // namespace isospline
