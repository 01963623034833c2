// B-splines: the functions beta^n, their weights within a cell, and their two-scale relation.
#pragma once

#include <array>
#include <cstddef>

namespace isospline {

/// A centred B-spline and its derivative at one point.
struct BasisValue {
    double value;
    double derivative;
};

/// beta^n and its derivative at x, for any n >= 0, by the joint recursion of the paper's appendix.
BasisValue bspline(int degree, double x);

/// beta^2 and its derivative at x - 1, x, x + 1, for -1/2 <= x <= 1/2.
template <typename Real>
struct QuadraticBasis {
    std::array<Real, 3> values;
    std::array<Real, 3> derivatives;
};

/// The 13 operations of the paper's appendix.
template <typename Real>
constexpr QuadraticBasis<Real> quadratic_basis(Real x);

/// The n+1 weights of a cell's coefficients at local coordinate s in [0, 1], along one axis: the j-th is
/// beta^n(s + (n-1)/2 - j), which holds for odd and even degrees alike. Evaluated by sums of products that are not
/// negative (Cox and de Boor), so that every weight has a small relative error.
template <int Degree, typename Real>
constexpr std::array<Real, Degree + 1> cell_weights(Real s);

/// First derivatives of cell_weights() by s.
template <int Degree, typename Real>
constexpr std::array<Real, Degree + 1> cell_derivatives(Real s);

/// Second derivatives of cell_weights() by s; zero for degrees 0 and 1.
template <int Degree, typename Real>
constexpr std::array<Real, Degree + 1> cell_second_derivatives(Real s);

/// Weights of a cell's coefficients for the value, the first and the second derivative.
template <int Degree, typename Real>
struct CellBasis {
    std::array<Real, Degree + 1> values;
    std::array<Real, Degree + 1> first;
    std::array<Real, Degree + 1> second;
};

/// All three at once.
template <int Degree, typename Real>
constexpr CellBasis<Degree, Real> cell_basis(Real s);

/// The two-scale relation (paper §5) for coefficients in a row: those of half the spacing are
///     fine_m = sum over j of coarse_j u_(m + n - 2j),
/// with the n+2 weights u_i = 2^-n binomial(n+1, i) given here, u_i = 0 for other i, and with both rows beginning at
/// the first coefficient that reaches the first cell. K coarse coefficients, which reach K - n cells, so give
/// 2 (K - n) + n fine ones. This holds for every degree: the shift that the paper prints, (n mod 2)/2, should read
/// ((n+1) mod 2)/2, and a row that begins where its cells begin has it built in.
template <int Degree, typename Real>
constexpr std::array<Real, Degree + 2> two_scale_weights();

inline BasisValue bspline(int degree, double x)
{
    if (degree == 0) {
        const auto sign = [](double y) { return static_cast<double>((y > 0.0) - (y < 0.0)); };
        return {0.5 * (sign(x + 0.5) - sign(x - 0.5)), 0.0};
    }
    const double n = degree;
    const double left = bspline(degree - 1, x + 0.5).value;
    const double right = bspline(degree - 1, x - 0.5).value;
    const double derivative = left - right;
    return {((x + 0.5 * (n + 1.0)) * derivative + (n + 1.0) * right) / n, derivative};
}

template <typename Real>
constexpr QuadraticBasis<Real> quadratic_basis(Real x)
{
    const Real before = Real(0.5) + x;
    const Real after = Real(1) - before;
    const Real slope = after - before;
    const Real first = Real(0.5) * before * before;
    const Real middle = Real(0.5) * ((x + Real(1.5)) * slope + Real(3) * before);
    return {{first, middle, Real(1) - middle - first}, {before, slope, -after}};
}

template <int Degree, typename Real>
constexpr std::array<Real, Degree + 1> cell_weights(Real s)
{
    static_assert(Degree >= 0);
    if constexpr (Degree == 0) {
        return {Real(1)};
    } else if constexpr (Degree == 1) {
        return {Real(1) - s, s};
    } else if constexpr (Degree == 2) {
        const Real r = Real(1) - s;
        return {Real(0.5) * r * r, Real(0.5) + r * s, Real(0.5) * s * s};
    } else if constexpr (Degree == 3) {
        const Real r = Real(1) - s;
        const Real sixth = Real(1) / Real(6);
        return {sixth * r * r * r, sixth * (Real(1) + Real(3) * r * (Real(1) + r * s)),
                sixth * (Real(1) + Real(3) * s * (Real(1) + r * s)), sixth * s * s * s};
    } else {
        const auto lower = cell_weights<Degree - 1>(s);
        const Real scale = Real(1) / Real(Degree);
        std::array<Real, Degree + 1> weights{};
        for (int j = 0; j <= Degree; ++j) {
            const auto at = static_cast<std::size_t>(j);
            if (j > 0)
                weights[at] += scale * (s + Real(Degree - j)) * lower[at - 1];
            if (j < Degree)
                weights[at] += scale * (Real(j + 1) - s) * lower[at];
        }
        return weights;
    }
}

namespace detail {

/// beta^n' = beta^(n-1)(. + 1/2) - beta^(n-1)(. - 1/2), for the weights of a cell or their derivatives.
template <typename Real, std::size_t Count>
constexpr std::array<Real, Count + 1> difference(const std::array<Real, Count>& lower)
{
    std::array<Real, Count + 1> derivatives{};
    derivatives[0] = -lower[0];
    for (std::size_t j = 1; j < Count; ++j)
        derivatives[j] = lower[j - 1] - lower[j];
    derivatives[Count] = lower[Count - 1];
    return derivatives;
}

} // namespace detail

template <int Degree, typename Real>
constexpr std::array<Real, Degree + 1> cell_derivatives(Real s)
{
    if constexpr (Degree == 0)
        return {Real(0)};
    else
        return detail::difference(cell_weights<Degree - 1>(s));
}

template <int Degree, typename Real>
constexpr std::array<Real, Degree + 1> cell_second_derivatives(Real s)
{
    if constexpr (Degree < 2)
        return {};
    else
        return detail::difference(cell_derivatives<Degree - 1>(s));
}

template <int Degree, typename Real>
constexpr CellBasis<Degree, Real> cell_basis(Real s)
{
    return {cell_weights<Degree>(s), cell_derivatives<Degree>(s), cell_second_derivatives<Degree>(s)};
}

template <int Degree, typename Real>
constexpr std::array<Real, Degree + 2> two_scale_weights()
{
    std::array<Real, Degree + 2> weights{};
    int binomial = 1;
    for (int i = 0; i <= Degree + 1; ++i) {
        weights[static_cast<std::size_t>(i)] = Real(binomial) / Real(1 << Degree);
        binomial = binomial * (Degree + 1 - i) / (i + 1);
    }
    return weights;
}

} // namespace isospline
