// Polynomials in Bernstein form on [0, 1]: sum over i of b_i C(D, i) s^i (1 - s)^(D - i).
#pragma once

#include <array>
#include <utility>

namespace isospline {

template <int Degree, typename Number = double>
using Bernstein = std::array<Number, Degree + 1>;

/// C(N, k) for k from 0 to N.
template <int N>
inline constexpr std::array<double, N + 1> binomials = [] {
    std::array<double, N + 1> row{1.0};
    for (int k = 0; k < N; ++k)
        row[k + 1] = row[k] * (N - k) / (k + 1);
    return row;
}();

/// Splits a polynomial at s = 1/2 into two, each on [0, 1] again (de Casteljau). `left` may be `b` itself.
template <int Degree>
inline void split_in_half(const Bernstein<Degree>& b, Bernstein<Degree>& left, Bernstein<Degree>& right)
{
    Bernstein<Degree> level = b;
    for (int i = 0; i <= Degree; ++i) {
        left[i] = level[0];
        right[Degree - i] = level[Degree - i];
        for (int j = 0; j < Degree - i; ++j)
            level[j] = 0.5 * (level[j] + level[j + 1]);
    }
}

/// The number of sign changes from one coefficient to the next; zero counts as positive. It is at least the number of
/// roots in (0, 1), and of the same parity (Descartes' rule of signs).
template <int Degree>
inline int sign_changes(const Bernstein<Degree>& b)
{
    int changes = 0;
    for (int i = 0; i < Degree; ++i)
        changes += (b[i] < 0.0) != (b[i + 1] < 0.0);
    return changes;
}

} // namespace isospline
