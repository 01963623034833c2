// Polynomials in Bernstein form on [0, 1]: sum over i of b_i C(D, i) s^i (1 - s)^(D - i).
#pragma once

#include <array>
#include <cmath>
#include <utility>

namespace isospline {

template <int Degree>
using Bernstein = std::array<double, Degree + 1>;

/// Interpolation of a polynomial of a degree at its Chebyshev-Lobatto nodes, as Bernstein coefficients.
template <int Degree>
struct ChebyshevLobatto {
    static constexpr int count = Degree + 1;

    std::array<double, count> nodes;                           ///< ascending in [0, 1], both ends included
    std::array<std::array<double, count>, count> to_bernstein; ///< b_i = sum over j of to_bernstein[i][j] value_j

    ChebyshevLobatto()
    {
        const long double pi = std::acos(-1.0L);
        std::array<std::array<long double, 2 * count>, count> system{};
        for (int i = 0; i < count; ++i) {
            const long double sine = std::sin(0.5L * pi * static_cast<long double>(i) / Degree);
            const long double s = sine * sine;
            nodes[static_cast<std::size_t>(i)] = static_cast<double>(s);
            // Row i holds the Bernstein basis at node i, beside the identity.
            long double binomial = 1.0L;
            for (int j = 0; j < count; ++j) {
                system[i][j] = binomial * std::pow(s, static_cast<long double>(j)) *
                               std::pow(1.0L - s, static_cast<long double>(Degree - j));
                binomial = binomial * static_cast<long double>(Degree - j) / static_cast<long double>(j + 1);
            }
            system[i][count + i] = 1.0L;
        }

        // Gauss-Jordan elimination with pivots leaves the inverse beside the identity.
        for (int column = 0; column < count; ++column) {
            int pivot = column;
            for (int row = column + 1; row < count; ++row)
                if (std::abs(system[row][column]) > std::abs(system[pivot][column]))
                    pivot = row;
            std::swap(system[column], system[pivot]);
            const long double scale = 1.0L / system[column][column];
            for (auto& entry : system[column])
                entry *= scale;
            for (int row = 0; row < count; ++row) {
                const long double factor = system[row][column];
                if (row != column)
                    for (int k = 0; k < 2 * count; ++k)
                        system[row][k] -= factor * system[column][k];
            }
        }
        for (int i = 0; i < count; ++i)
            for (int j = 0; j < count; ++j)
                to_bernstein[i][j] = static_cast<double>(system[i][count + j]);
    }
};

template <int Degree>
inline const ChebyshevLobatto<Degree> chebyshev_lobatto{};

/// The two halves of a polynomial at s = 1/2, each on [0, 1] again (de Casteljau). `left` may be `b` itself.
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

/// Changes of sign from one coefficient to the next, zero counting as positive: at least as many as there are roots in
/// (0, 1), and of the same parity (Descartes' rule of signs).
template <int Degree>
inline int sign_changes(const Bernstein<Degree>& b)
{
    int changes = 0;
    for (int i = 0; i < Degree; ++i)
        changes += (b[i] < 0.0) != (b[i + 1] < 0.0);
    return changes;
}

/// Coefficients of 1, s, s^2, ... of the same polynomial.
template <int Degree>
inline std::array<double, Degree + 1> to_monomial(Bernstein<Degree> b)
{
    // The k-th forward difference of the b_i, times C(D, k).
    double binomial = 1.0;
    for (int k = 1; k <= Degree; ++k) {
        for (int i = Degree; i >= k; --i)
            b[i] -= b[i - 1];
    }
    for (int k = 0; k <= Degree; ++k) {
        b[k] *= binomial;
        binomial = binomial * (Degree - k) / (k + 1);
    }
    return b;
}

} // namespace isospline
