// Polynomials of three variables in tensor Bernstein form on the unit cube: the sum over i, j, k of b_ijk B_i(x) B_j(y)
// B_k(z).
#pragma once

#include "isospline/math/bernstein.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace isospline {

/// b_ijk is item i + (Degree + 1) (j + (Degree + 1) k).
template <int Degree>
using BernsteinBox = std::array<double, static_cast<std::size_t>((Degree + 1) * (Degree + 1) * (Degree + 1))>;

/// The item of b_ijk.
template <int Degree>
constexpr std::size_t bernstein_item(int i, int j, int k)
{
    return static_cast<std::size_t>(i + (Degree + 1) * (j + (Degree + 1) * k));
}

/// Calls `map(row)` with each row of coefficients along an axis, which it may change.
template <int Degree, typename Map>
inline void map_rows(BernsteinBox<Degree>& b, int axis, Map map)
{
    constexpr std::size_t count = Degree + 1;
    const std::size_t stride = axis == 0 ? 1 : axis == 1 ? count : count * count;
    const std::size_t across = axis == 0 ? count : 1, slice = axis == 2 ? count : count * count;
    for (std::size_t second = 0; second < count; ++second)
        for (std::size_t first = 0; first < count; ++first) {
            double* const from = b.data() + first * across + second * slice;
            Bernstein<Degree> row;
            for (std::size_t i = 0; i < count; ++i)
                row[i] = from[i * stride];
            map(row);
            for (std::size_t i = 0; i < count; ++i)
                from[i * stride] = row[i];
        }
}

/// The polynomial on one half of the cube, cut across an axis, as one on the unit cube again.
template <int Degree>
inline BernsteinBox<Degree> half_of(BernsteinBox<Degree> b, int axis, bool upper)
{
    map_rows<Degree>(b, axis, [upper](Bernstein<Degree>& row) {
        Bernstein<Degree> left, right;
        split_in_half<Degree>(row, left, right);
        row = upper ? right : left;
    });
    return b;
}

/// An axis along which a polynomial is proven to be monotonic, so that its zeros are a graph over the other axes.
struct GraphAxis {
    int axis = -1;      ///< the one with the steepest smallest slope; -1 if there is none
    double slope = 0.0; ///< the smallest slope along it divided by the largest slope along any axis
};
template <int Degree>
GraphAxis graph_axis(const BernsteinBox<Degree>& b)
{
    constexpr int strides[3] = {1, Degree + 1, (Degree + 1) * (Degree + 1)};
    double least[3] = {1e300, 1e300, 1e300}, most[3] = {-1e300, -1e300, -1e300};
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j)
            for (int i = 0; i <= Degree; ++i)
                for (int axis = 0; axis < 3; ++axis) {
                    if ((axis == 0 ? i : axis == 1 ? j : k) == Degree)
                        continue;
                    const std::size_t item = bernstein_item<Degree>(i, j, k);
                    const double slope = b[item + static_cast<std::size_t>(strides[axis])] - b[item];
                    least[axis] = std::min(least[axis], slope);
                    most[axis] = std::max(most[axis], slope);
                }
    GraphAxis found;
    double best = 0.0, steepest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double smallest = std::max(least[axis], -most[axis]);
        steepest = std::max({steepest, most[axis], -least[axis]});
        if (smallest > best) {
            found.axis = axis;
            best = smallest;
        }
    }
    found.slope = found.axis < 0 ? 0.0 : best / steepest;
    return found;
}

/// The smallest and the largest of some numbers.
template <typename Number>
struct Extremes {
    Number least, most;
};

/// Without branches, unlike std::minmax_element: for numbers in no order, it is several times as fast.
template <typename Number, std::size_t Count>
Extremes<Number> extremes_of(const std::array<Number, Count>& numbers)
{
    Number least = numbers[0], most = numbers[0];
    for (const Number each : numbers) {
        least = each < least ? each : least;
        most = each > most ? each : most;
    }
    return {least, most};
}

} // namespace isospline
