// Weights of a cell's coefficients, for any number. Included once for each SIMD target.
#include "isospline/math/number-inl.h"

#include <array>
#include <cstddef>

#if defined(ISOSPLINE_SPLINE_CELL_WEIGHTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_SPLINE_CELL_WEIGHTS_INL_H
#undef ISOSPLINE_SPLINE_CELL_WEIGHTS_INL_H
#else
#define ISOSPLINE_SPLINE_CELL_WEIGHTS_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// The n+1 weights of a cell's coefficients at local coordinate u in [0, 1], along one axis. Weight j is
/// beta^n(u + (n-1)/2 - j), for odd and even degrees. No weight is negative. Two neighbouring cells share n
/// coefficients: their weights at u = 1 in one cell equal bit for bit those at u = 0 in the other, and the remaining
/// weight is zero.
template <int Degree, class N>
HWY_INLINE constexpr std::array<N, Degree + 1> cell_weights(N u)
{
    static_assert(Degree >= 0);
    const N one = number<N>(1.0), half = number<N>(0.5);
    const N v = one - u;
    if constexpr (Degree == 0) {
        return {one};
    } else if constexpr (Degree == 1) {
        return {v, u};
    } else if constexpr (Degree == 2) {
        return {half * v * v, mul_add(u, v, half), half * u * u};
    } else if constexpr (Degree == 3) {
        // 2/3 - 1/2 is a middle weight at an end of the cell: it is 1/6 except for its last bits.
        const N two_thirds = number<N>(2.0 / 3.0), sixth = two_thirds - half;
        const N uu = u * u, vv = v * v;
        return {sixth * v * vv, mul_add(uu, mul_sub(half, u, one), two_thirds),
                mul_add(vv, mul_sub(half, v, one), two_thirds), sixth * u * uu};
    } else {
        // The recursion of Cox and de Boor.
        const auto lower = cell_weights<Degree - 1>(u);
        const N scale = number<N>(1.0 / Degree);
        std::array<N, Degree + 1> weights;
        weights[0] = scale * v * lower[0];
        for (int j = 1; j < Degree; ++j)
            weights[j] = scale * ((u + number<N>(Degree - j)) * lower[j - 1] + (number<N>(j + 1) - u) * lower[j]);
        weights[Degree] = scale * u * lower[Degree - 1];
        return weights;
    }
}

/// beta^n' = beta^(n-1)(. + 1/2) - beta^(n-1)(. - 1/2), for the weights of a cell or their derivatives.
template <class N, std::size_t Count>
HWY_INLINE constexpr std::array<N, Count + 1> differences(const std::array<N, Count>& lower)
{
    std::array<N, Count + 1> derivatives;
    derivatives[0] = negated(lower[0]);
    for (std::size_t j = 1; j < Count; ++j)
        derivatives[j] = lower[j - 1] - lower[j];
    derivatives[Count] = lower[Count - 1];
    return derivatives;
}

/// First derivatives of cell_weights() by u.
template <int Degree, class N>
HWY_INLINE constexpr std::array<N, Degree + 1> cell_derivatives(N u)
{
    if constexpr (Degree == 0)
        return {number<N>(0.0)};
    else
        return differences(cell_weights<Degree - 1>(u));
}

/// Second derivatives of cell_weights() by u; zero for degrees 0 and 1.
template <int Degree, class N>
HWY_INLINE constexpr std::array<N, Degree + 1> cell_second_derivatives(N u)
{
    if constexpr (Degree == 0)
        return {number<N>(0.0)};
    else if constexpr (Degree == 1)
        return {number<N>(0.0), number<N>(0.0)};
    else
        return differences(cell_derivatives<Degree - 1>(u));
}

/// Weights of a cell's coefficients for the value, the first and the second derivative.
template <int Degree, class N>
struct CellBasis {
    std::array<N, Degree + 1> values, first, second;
};

/// All three at once.
template <int Degree, class N>
HWY_INLINE constexpr CellBasis<Degree, N> cell_basis(N u)
{
    return {cell_weights<Degree>(u), cell_derivatives<Degree>(u), cell_second_derivatives<Degree>(u)};
}

/// The sum of coefficient(i, j, k) x[i] y[j] z[k]; y is summed first, then z, then x.
template <class N, std::size_t Count, class Coefficient>
HWY_INLINE N weighted_sum(const Coefficient& coefficient, const std::array<N, Count>& x, const std::array<N, Count>& y,
                          const std::array<N, Count>& z)
{
    N sum = number<N>(0.0);
    for (std::size_t i = 0; i < Count; ++i) {
        N plane = number<N>(0.0);
        for (std::size_t k = 0; k < Count; ++k) {
            N line = y[0] * in_lanes<N>(coefficient(i, 0, k));
            for (std::size_t j = 1; j < Count; ++j)
                line = mul_add(y[j], in_lanes<N>(coefficient(i, j, k)), line);
            plane = mul_add(z[k], line, plane);
        }
        sum = mul_add(x[i], plane, sum);
    }
    return sum;
}

/// Converts coefficients of uniform B-splines on a cell to coefficients of Bernstein polynomials, along one axis.
template <int Degree, class N>
HWY_INLINE constexpr std::array<N, Degree + 1> bernstein_of_bspline(const std::array<N, Degree + 1>& c)
{
    static_assert(Degree >= 1 && Degree <= 3);
    const N half = number<N>(0.5);
    if constexpr (Degree == 1) {
        return c;
    } else if constexpr (Degree == 2) {
        return {half * (c[0] + c[1]), c[1], half * (c[1] + c[2])};
    } else {
        // Insert knots at both ends of the cell.
        const N two = number<N>(2.0), third = number<N>(1.0 / 3.0);
        const N before = third * mul_add(two, c[1], c[0]), left = third * mul_add(two, c[1], c[2]);
        const N right = third * mul_add(two, c[2], c[1]), after = third * mul_add(two, c[2], c[3]);
        return {half * (before + left), left, right, half * (right + after)};
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
