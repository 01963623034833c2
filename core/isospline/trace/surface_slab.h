// An oriented slab around the part of the surface in a cell.
#pragma once

#include "isospline/trace/cell_block.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace isospline {

/// The surface in a cell is where lower <= <normal, local> <= upper, local being coordinates in [0, 1]^3.
struct SurfaceSlab {
    std::array<std::int8_t, 3> normal; ///< components of at most 31
    std::int8_t lower, upper;
};

/// The slab along the mean gradient of a cell.
///
/// B-splines reproduce linear functions: a linear l is the spline whose coefficients are its values at the Greville
/// abscissae, (n+1)/2 apart from the first knot. So f - l is the spline of the differences, and lies between the least
/// and the largest of them, as the weights are not negative and sum to one. Where f is the level, l is between the
/// negatives of these.
template <int Degree>
inline SurfaceSlab surface_slab(const CellBlock& cell)
{
    // Positions of coefficients from the middle of the cell, and the slope of the least-squares fit along each axis.
    const auto position = [](int i) { return i - 0.5 * Degree; };
    std::array<double, 3> slope{};
    std::array<std::array<std::array<double, Degree + 1>, Degree + 1>, Degree + 1> coefficients;
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j) {
            const float* row = cell.coefficients + j * cell.row_stride + k * cell.slice_stride;
            double sum = 0.0;
            for (int i = 0; i <= Degree; ++i) {
                const double coefficient = static_cast<double>(row[i]) - cell.threshold;
                coefficients[k][j][i] = coefficient;
                sum += coefficient;
                slope[0] += position(i) * coefficient;
            }
            slope[1] += position(j) * sum;
            slope[2] += position(k) * sum;
        }
    const double largest = std::max({std::abs(slope[0]), std::abs(slope[1]), std::abs(slope[2])});
    SurfaceSlab slab{{0, 0, 0}, -128, 127};
    if (!(largest > 0.0))
        return slab;

    // The linear function along the rounded normal.
    std::array<double, 3> normal;
    double dot = 0.0, square = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        slab.normal[axis] = static_cast<std::int8_t>(std::lround(31.0 * slope[axis] / largest));
        normal[axis] = slab.normal[axis];
        dot += normal[axis] * slope[axis];
        square += normal[axis] * normal[axis];
    }
    double squares_of_positions = 0.0;
    for (int i = 0; i <= Degree; ++i)
        squares_of_positions += position(i) * position(i) * (Degree + 1) * (Degree + 1);
    const double scale = dot / square / squares_of_positions;

    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j) {
            const double across = scale * (normal[1] * position(j) + normal[2] * position(k));
            for (int i = 0; i <= Degree; ++i) {
                const double difference = coefficients[k][j][i] - (across + scale * normal[0] * position(i));
                least = std::min(least, difference);
                most = std::max(most, difference);
            }
        }
    const double middle = 0.5 * (normal[0] + normal[1] + normal[2]);
    constexpr double rounding = 1e-6;
    slab.lower = static_cast<std::int8_t>(std::clamp(std::floor(middle - most / scale - rounding), -128.0, 127.0));
    slab.upper = static_cast<std::int8_t>(std::clamp(std::ceil(middle - least / scale + rounding), -128.0, 127.0));
    return slab;
}

} // namespace isospline
