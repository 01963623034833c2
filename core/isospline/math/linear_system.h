// Small dense systems of linear equations.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace isospline {

/// A row of the matrix, followed by its right-hand sides.
template <std::size_t Capacity, std::size_t RightSides = 1>
using LinearSystem = std::array<std::array<double, Capacity + RightSides>, Capacity>;

/// Solves the first `size` equations for as many unknowns by Gaussian elimination with partial pivoting. Coefficients
/// should be of similar magnitude. The right-hand sides become the solutions. False if a pivot is not above `tiny`.
template <std::size_t Capacity, std::size_t Width>
inline bool solve(std::array<std::array<double, Width>, Capacity>& system, std::size_t size, double tiny)
{
    const auto subtract = [&](std::size_t row, double factor, std::size_t other, std::size_t first) {
        for (std::size_t item = first; item < Width; ++item)
            system[row][item] -= factor * system[other][item];
    };
    for (std::size_t column = 0; column < size; ++column) {
        std::size_t pivot = column;
        for (std::size_t row = column + 1; row < size; ++row)
            if (std::abs(system[row][column]) > std::abs(system[pivot][column]))
                pivot = row;
        if (!(std::abs(system[pivot][column]) > tiny))
            return false;
        std::swap(system[pivot], system[column]);
        for (std::size_t row = column + 1; row < size; ++row)
            subtract(row, system[row][column] / system[column][column], column, column);
    }
    for (std::size_t row = size; row-- > 0;) {
        for (std::size_t item = row + 1; item < size; ++item)
            subtract(row, system[row][item], item, Capacity);
        for (std::size_t side = Capacity; side < Width; ++side)
            system[row][side] /= system[row][row];
    }
    return true;
}

} // namespace isospline
