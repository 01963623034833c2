// f along a straight segment inside one cell: a polynomial of degree 3n in Bernstein form.
#pragma once

#include "isospline/math/bernstein.h"
#include "isospline/trace/cell_block.h"

#include <array>

namespace isospline {

/// The n+1 weights of a cell along one axis, each as a polynomial of s on the segment from local coordinate a (s = 0)
/// to e (s = 1): item [i][p] is the scaled Bernstein coefficient p of weight i, C(n, p) times its polar form (blossom)
/// with n - p arguments a and p arguments e. None is negative for a and e in [0, 1], and column p sums to C(n, p). On a
/// face, a or e being 0 or 1, the weights of the coefficients that two cells share are the same in both, bit for bit.
template <int Degree>
inline std::array<std::array<double, Degree + 1>, Degree + 1> segment_weights(double a, double e)
{
    static_assert(Degree >= 1 && Degree <= 3);
    const double va = 1.0 - a, ve = 1.0 - e;
    if constexpr (Degree == 1) {
        return {{{va, ve}, {a, e}}};
    } else if constexpr (Degree == 2) {
        // 1/2 (1-u)^2, 1/2 + u - u^2 and 1/2 u^2
        return {{{0.5 * va * va, va * ve, 0.5 * ve * ve},
                 {0.5 + a * va, 1.0 + a * ve + e * va, 0.5 + e * ve},
                 {0.5 * a * a, a * e, 0.5 * e * e}}};
    } else {
        // v^3 / 6, (1 + 3 v + 3 v^2 - 3 v^3) / 6 with v = 1-u, the same of u, u^3 / 6
        const auto outer = [](double x, double y) {
            return std::array{x * x * x / 6.0, 3.0 * x * x * y / 6.0, 3.0 * x * y * y / 6.0, y * y * y / 6.0};
        };
        const auto inner = [](double x, double y) {
            const auto polar_form = [](double p, double q, double r) {
                return 1.0 + (p + q + r) + (p * q + p * r + q * r) - 3.0 * (p * q * r);
            };
            return std::array{polar_form(x, x, x) / 6.0, 3.0 * polar_form(x, x, y) / 6.0,
                              3.0 * polar_form(x, y, y) / 6.0, polar_form(y, y, y) / 6.0};
        };
        return {{outer(va, ve), inner(va, ve), inner(a, e), outer(a, e)}};
    }
}

/// f - level from local coordinates `entry` to `exit` of a cell, as Bernstein coefficients in [0, 1] along the way.
///
/// Along the segment the weights of each axis are polynomials of degree n. In scaled Bernstein form, coefficients times
/// binomials, a product of polynomials is the convolution of its factors, so the sum over the cell's coefficients is
/// contracted axis by axis: z, y, x. Every result is a convex combination of the cell's coefficients, which is why its
/// rounding error is small (docs/method.md).
template <int Degree>
inline Bernstein<3 * Degree> bernstein_along_segment(const CellBlock& cell, const glm::dvec3& entry,
                                                     const glm::dvec3& exit)
{
    const auto wx = segment_weights<Degree>(entry.x, exit.x);
    const auto wy = segment_weights<Degree>(entry.y, exit.y);
    const auto wz = segment_weights<Degree>(entry.z, exit.z);
    Bernstein<3 * Degree> scaled{};
    for (int i = 0; i <= Degree; ++i) {
        std::array<double, 2 * Degree + 1> of_yz{};
        for (int j = 0; j <= Degree; ++j) {
            std::array<double, Degree + 1> of_z{};
            for (int k = 0; k <= Degree; ++k) {
                const double coefficient =
                    static_cast<double>(cell.coefficients[i + j * cell.row_stride + k * cell.slice_stride]) -
                    cell.threshold;
                for (int m = 0; m <= Degree; ++m)
                    of_z[m] += wz[k][m] * coefficient;
            }
            for (int p = 0; p <= Degree; ++p)
                for (int m = 0; m <= Degree; ++m)
                    of_yz[p + m] += wy[j][p] * of_z[m];
        }
        for (int p = 0; p <= Degree; ++p)
            for (int q = 0; q <= 2 * Degree; ++q)
                scaled[p + q] += wx[i][p] * of_yz[q];
    }
    for (int r = 0; r <= 3 * Degree; ++r)
        scaled[r] /= binomials<3 * Degree>[r];
    return scaled;
}

} // namespace isospline
