// A box around the part of a cell that can hold the surface.
#pragma once

#include "isospline/math/box.h"
#include "isospline/spline/basis.h"
#include "isospline/trace/cell_block.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace isospline {

namespace detail {

/// Coefficients along a line that reach `Cells` cells, on a grid of half the spacing (paper §5).
template <int Degree, int Cells>
inline std::array<double, 2 * Cells + Degree> subdivide(const std::array<double, Cells + Degree>& coarse)
{
    constexpr auto weights = two_scale_weights<Degree, double>();
    std::array<double, 2 * Cells + Degree> fine{};
    for (int m = 0; m < 2 * Cells + Degree; ++m)
        for (int j = 0; j < Cells + Degree; ++j) {
            const int i = m + Degree - 2 * j;
            if (i >= 0 && i <= Degree + 1)
                fine[m] += weights[i] * coarse[j];
        }
    return fine;
}

} // namespace detail

/// The part of a cell that can hold the surface, in quarters of the cell's edge: for each axis, from x in the lowest
/// bits on, two bits for the first and two for the last quarter. Along each axis in turn the coefficients are
/// subdivided to quarters; quarters at either end whose coefficients have one sign are left out.
template <int Degree>
inline std::uint16_t tight_quarters(const CellBlock& cell)
{
    constexpr int slabs = 4;
    constexpr int fine_count = slabs + Degree;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const std::array<std::ptrdiff_t, 3> strides{1, cell.row_stride, cell.slice_stride};

    unsigned quarters = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::ptrdiff_t along = strides[axis];
        const std::ptrdiff_t across = strides[(axis + 1) % 3], upwards = strides[(axis + 2) % 3];

        // Extremes of the fine coefficients over all lines along the axis.
        std::array<double, fine_count> least, most;
        least.fill(infinity);
        most.fill(-infinity);
        for (int k = 0; k <= Degree; ++k)
            for (int j = 0; j <= Degree; ++j) {
                const float* line = cell.coefficients + j * across + k * upwards;
                std::array<double, Degree + 1> coarse;
                for (int i = 0; i <= Degree; ++i)
                    coarse[i] = static_cast<double>(line[i * along]) - cell.threshold;
                const auto fine = detail::subdivide<Degree, 2>(detail::subdivide<Degree, 1>(coarse));
                for (int i = 0; i < fine_count; ++i) {
                    least[i] = std::min(least[i], fine[i]);
                    most[i] = std::max(most[i], fine[i]);
                }
            }

        const auto is_empty = [&](int slab) {
            return *std::min_element(&least[slab], &least[slab] + Degree + 1) >= 0.0 ||
                   *std::max_element(&most[slab], &most[slab] + Degree + 1) < 0.0;
        };
        int first = 0, last = slabs - 1;
        while (first < last && is_empty(first))
            ++first;
        while (last > first && is_empty(last))
            --last;
        quarters |= static_cast<unsigned>(first | last << 2) << (4 * axis);
    }
    return static_cast<std::uint16_t>(quarters);
}

/// The box of these quarters of a cell, in lattice space.
inline Box tight_box(std::uint16_t quarters, const glm::dvec3& cell_lower)
{
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
        const int bits = quarters >> (4 * axis);
        box.lower[axis] = cell_lower[axis] + 0.25 * (bits & 3);
        box.upper[axis] = cell_lower[axis] + 0.25 * ((bits >> 2 & 3) + 1);
    }
    return box;
}

} // namespace isospline
