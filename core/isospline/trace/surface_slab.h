// An oriented slab around the part of the surface in a cell.
#pragma once

#include "isospline/math/box.h"
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
    constexpr int count = Degree + 1;
    const auto position = [](int i) { return static_cast<float>(i) - 0.5f * Degree; };
    float coefficients[count * count * count];
    float sums[3] = {};
    float magnitude = 0.0f;
    const auto threshold = static_cast<float>(cell.threshold);
    for (int k = 0; k < count; ++k)
        for (int j = 0; j < count; ++j) {
            const float* row = cell.coefficients + j * cell.row_stride + k * cell.slice_stride;
            float sum = 0.0f;
            for (int i = 0; i < count; ++i) {
                const float coefficient = row[i] - threshold;
                coefficients[(k * count + j) * count + i] = coefficient;
                magnitude = std::max(magnitude, std::abs(coefficient));
                sum += coefficient;
                sums[0] += position(i) * coefficient;
            }
            sums[1] += position(j) * sum;
            sums[2] += position(k) * sum;
        }
    const float largest = std::max({std::abs(sums[0]), std::abs(sums[1]), std::abs(sums[2])});
    SurfaceSlab slab{{0, 0, 0}, -128, 127};
    if (!(largest > 0.0f))
        return slab;

    // The linear function along the rounded normal.
    float normal[3], dot = 0.0f, square = 0.0f, squares_of_positions = 0.0f;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const float component = 31.0f * sums[axis] / largest;
        slab.normal[axis] = static_cast<std::int8_t>(component + (component < 0.0f ? -0.5f : 0.5f));
        normal[axis] = slab.normal[axis];
        dot += normal[axis] * sums[axis];
        square += normal[axis] * normal[axis];
    }
    for (int i = 0; i < count; ++i)
        squares_of_positions += position(i) * position(i) * static_cast<float>(count * count);
    const float scale = dot / (square * squares_of_positions);

    float least = std::numeric_limits<float>::infinity(), most = -least;
    for (int k = 0; k < count; ++k)
        for (int j = 0; j < count; ++j) {
            const float across = scale * (normal[1] * position(j) + normal[2] * position(k));
            for (int i = 0; i < count; ++i) {
                const float difference =
                    coefficients[(k * count + j) * count + i] - (across + scale * normal[0] * position(i));
                least = std::min(least, difference);
                most = std::max(most, difference);
            }
        }

    // A difference is off by at most 16 roundings of numbers of at most 5 times the magnitude, and the threshold's own.
    const float rounding = 0x1p-24f * (80.0f * magnitude + 2.0f * std::abs(threshold));
    const float middle = 0.5f * (normal[0] + normal[1] + normal[2]);
    const float lower = middle - (most + rounding) / scale, upper = middle - (least - rounding) / scale;
    constexpr float of_the_quotient = 1e-4f;
    slab.lower = static_cast<std::int8_t>(std::clamp(std::floor(lower - of_the_quotient), -128.0f, 127.0f));
    slab.upper = static_cast<std::int8_t>(std::clamp(std::ceil(upper + of_the_quotient), -128.0f, 127.0f));
    return slab;
}

/// The box of what a slab and the cell have in common, in local coordinates; empty where they have nothing.
inline Box bounds(const SurfaceSlab& slab)
{
    double least = 0.0, most = 0.0; // of <normal, local> in the cell
    for (const int component : slab.normal) {
        least += std::min(component, 0);
        most += std::max(component, 0);
    }
    Box box{glm::dvec3(0.0), glm::dvec3(1.0)};
    for (int axis = 0; axis < 3; ++axis) {
        const double component = slab.normal[static_cast<std::size_t>(axis)];
        if (component == 0.0)
            continue;
        // What is left for this axis when the others are at their ends.
        const double from_lower = (slab.lower - (most - std::max(component, 0.0))) / component;
        const double from_upper = (slab.upper - (least - std::min(component, 0.0))) / component;
        box.lower[axis] = std::max(0.0, std::min(from_lower, from_upper));
        box.upper[axis] = std::min(1.0, std::max(from_lower, from_upper));
    }
    return box;
}

} // namespace isospline
