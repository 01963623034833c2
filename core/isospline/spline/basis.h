// B-splines: the functions beta^n and their two-scale relation.
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

/// The n+2 weights u_i = 2^-n binomial(n+1, i) of the two-scale relation (paper §5). A row of coarse coefficients gives
/// the fine coefficients at half the spacing:
///     fine_m = sum over j of coarse_j u_(m + n - 2j),   u_i = 0 for other i.
/// Both rows begin at the first coefficient that influences the first cell. K coarse coefficients influence K - n cells
/// and give 2 (K - n) + n fine ones. This holds for every degree. The paper prints the shift (n mod 2)/2, which should
/// be ((n+1) mod 2)/2; it is not needed here, because rows begin where their cells begin.
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
