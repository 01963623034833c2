// The tables of Chebyshev-Lobatto interpolation in the form that SIMD lanes want. Apart from the SIMD code, so that
// they are set up at the start of a program with instructions that every machine has.
#pragma once

#include "isospline/math/bernstein.h"

#include <cmath>

namespace isospline {

/// Nodes and matrix for polynomials along rays in cells of a degree, padded with copies of node 0 to a power of two.
template <typename T, int Degree>
struct NodeTables {
    static constexpr int bernstein_degree = 3 * Degree;
    static constexpr int count = bernstein_degree + 1;
    static constexpr int padded_count = Degree == 1 ? 4 : Degree == 2 ? 8 : 16;

    alignas(64) T nodes[padded_count];
    alignas(64) T columns[count][padded_count]; ///< column j of to_bernstein
    alignas(64) T bounds[padded_count];         ///< of |error| of coefficient i, in units of rounding error of a value

    NodeTables()
    {
        // Not the global of this type: the order in which globals are set up is open.
        const ChebyshevLobatto<bernstein_degree> interpolation;
        for (int i = 0; i < padded_count; ++i) {
            const int row = i < count ? i : 0;
            nodes[i] = static_cast<T>(interpolation.nodes[row]);
            T bound = 0;
            for (int j = 0; j < count; ++j) {
                columns[j][i] = static_cast<T>(interpolation.to_bernstein[row][j]);
                bound += std::abs(columns[j][i]);
            }
            bounds[i] = bound;
        }
    }
};

template <typename T, int Degree>
inline const NodeTables<T, Degree> node_tables{};

} // namespace isospline
