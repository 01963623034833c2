// The recursive filter that turns the samples along one axis into B-spline coefficients.
#pragma once

#include "isospline/spline/filter.h"

#include <vector>

namespace isospline {

/// A symmetric filter B(z) gain / (A(z) A(1/z)), with A(z) = 1 - sum over k >= 1 of feedback[k-1] z^-k.
/// It keeps constants.
struct RecursiveFilter {
    std::vector<double> feedback;  ///< empty: no recursion
    std::vector<double> numerator; ///< taps 0, 1, ... of one side of B; empty: B = 1
    double gain = 1.0;
    double largest_pole = 0.0; ///< its modulus: the impulse response decays like its powers

    bool is_identity() const { return feedback.empty() && numerator.empty(); }
};

/// The number of steps after which the impulse response is below `forgotten` times its first value. Several poles of
/// the same modulus decay more slowly than one; twice the steps of one pole cover this.
double filter_horizon(const RecursiveFilter& filter, double forgotten);

/// Bounds on what a filter does to a line of numbers, from the impulse response of its recursion.
struct FilterNorm {
    double recursion; ///< sum of |response| of one recursion, 1 / A
    double whole;     ///< no number of the result exceeds the largest number of the line this many times
};
FilterNorm norm_of(const RecursiveFilter& filter);

/// The number of samples on each side of a part of a volume that its coefficients depend on. Samples farther away
/// change a coefficient by less than 2^-35 of the range of the samples. That is 1/1024 of the rounding of float32 if
/// coefficients are as large as half the range. Reason: for a filter with response |h(k)| <= C |z|^|k|, these samples
/// contribute at most C |z|^(reach + 1) / (1 - |z|) along each axis, and |z|^reach is below 2^-40.
int filter_reach(const RecursiveFilter& filter);

/// The largest weight of the roughness. Smaller weights already smooth a volume of any size to its mean.
inline constexpr double largest_smoothing = 1e9;

/// The filter of a degree.
///
/// Filter::interpolate inverts the sampled B-spline b^n (Unser, Aldroubi & Eden 1993, part II; the paper's §1):
/// poles sqrt(8) - 3 for n = 2, sqrt(3) - 2 for n = 3, two for n = 4 and 5.
///
/// Filter::smoothing gives, among all splines s of degree n, the minimiser of
///     sum over k of (f(k) - s(k))^2 + smoothing * integral of (d^m s / dx^m)^2,   m = floor(n/2) + 1,
/// along each axis in turn. Its coefficients solve (b^n b^n + smoothing r) c = b^n f with
/// r = |delta|^(2m) b^(2(n-m)+1), where delta is the backward difference. For odd n = 2m-1, r = |delta|^(2m) b^n; b^n
/// cancels, which gives the smoothing spline of the same reference. Degree 0 has no derivative: there the roughness is
/// the sum of the squared differences of neighbours.
RecursiveFilter design_filter(int degree, Filter filter, double smoothing);

} // namespace isospline
