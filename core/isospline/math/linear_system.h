// Small dense systems of linear equations.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace isospline {

/// A row of the matrix and, as its last item, the right side.
template <std::size_t Capacity>
using LinearSystem = std::array<std::array<double, Capacity + 1>, Capacity>;

/// Solves the first `size` equations of as many unknowns, whose coefficients are of about one magnitude, by Gaussian
/// elimination with partial pivoting; the right sides become the solution. False where a pivot is below `tiny`.
template <std::size_t Capacity>
inline bool solve(LinearSystem<Capacity>& system, std::size_t size, double tiny)
{
    for (std::size_t column = 0; column < size; ++column) {
        std::size_t pivot = column;
        for (std::size_t row = column + 1; row < size; ++row)
            if (std::abs(system[row][column]) > std::abs(system[pivot][column]))
                pivot = row;
        if (!(std::abs(system[pivot][column]) > tiny))
            return false;
        std::swap(system[pivot], system[column]);
        for (std::size_t row = column + 1; row < size; ++row) {
            const double factor = system[row][column] / system[column][column];
            for (std::size_t item = column; item < size; ++item)
                system[row][item] -= factor * system[column][item];
            system[row][Capacity] -= factor * system[column][Capacity];
        }
    }
    for (std::size_t row = size; row-- > 0;) {
        for (std::size_t item = row + 1; item < size; ++item)
            system[row][Capacity] -= system[row][item] * system[item][Capacity];
        system[row][Capacity] /= system[row][row];
    }
    return true;
}

} // namespace isospline
