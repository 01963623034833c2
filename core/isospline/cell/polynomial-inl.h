// f along a straight segment inside one cell: a polynomial of degree 3n in Bernstein form. Included once for each SIMD
// target.
#include "isospline/math/bernstein.h"
#include "isospline/spline/cell_weights-inl.h"

#include <glm/vec3.hpp>

#include <array>
#include <type_traits>

#if defined(ISOSPLINE_CELL_POLYNOMIAL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_POLYNOMIAL_INL_H
#undef ISOSPLINE_CELL_POLYNOMIAL_INL_H
#else
#define ISOSPLINE_CELL_POLYNOMIAL_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// The n+1 weights of a cell along one axis, each as a polynomial of s on the segment from local coordinate a (s = 0)
/// to e (s = 1): item [i][p] is the scaled Bernstein coefficient p of weight i, C(n, p) times its polar form (blossom)
/// with n - p arguments a and p arguments e. None is negative for a and e in [0, 1], and column p sums to C(n, p). The
/// first and the last column are the weights at a and at e.
template <int Degree, class N>
using SegmentWeights = std::array<std::array<N, Degree + 1>, Degree + 1>;

template <int Degree, class N>
HWY_INLINE SegmentWeights<Degree, N> segment_weights(N a, N e)
{
    static_assert(Degree >= 1 && Degree <= 3);
    const N one = number<N>(1.0);
    const N va = one - a, ve = one - e;
    const auto begin = cell_weights<Degree>(a), end = cell_weights<Degree>(e);
    if constexpr (Degree == 1) {
        return {{{begin[0], end[0]}, {begin[1], end[1]}}};
    } else if constexpr (Degree == 2) {
        SegmentWeights<Degree, N> w;
        for (int i = 0; i <= 2; ++i) {
            w[i][0] = begin[i];
            w[i][2] = end[i];
        }
        w[0][1] = va * ve;
        w[1][1] = mul_add(a, ve, mul_add(e, va, one));
        w[2][1] = a * e;
        return w;
    } else {
        // The blossoms of u^3 / 6 at two x and a y, and of 2/3 - u^2 + u^3 / 2; u is v from the cell's other end.
        const N half = number<N>(0.5), two = number<N>(2.0), three_halves = number<N>(1.5);
        const auto outer = [half](N x, N y) HWY_ATTR { return half * y * (x * x); };
        const auto inner = [=](N x, N y)
                               HWY_ATTR { return mul_add(x * x, mul_sub(three_halves, y, one), two - two * x * y); };
        return {{{begin[0], outer(va, ve), outer(ve, va), end[0]},
                 {begin[1], inner(a, e), inner(e, a), end[1]},
                 {begin[2], inner(va, ve), inner(ve, va), end[2]},
                 {begin[3], outer(a, e), outer(e, a), end[3]}}};
    }
}

/// One line of the sum in scaled_bernstein(): y and z are contracted; `load(j, k)` is the coefficient of row j and
/// slice k.
template <int Degree, class N, class Load>
HWY_INLINE std::array<N, 2 * Degree + 1> contract_yz(const SegmentWeights<Degree, N>& y,
                                                     const SegmentWeights<Degree, N>& z, const Load& load)
{
    std::array<N, 2 * Degree + 1> line;
    for (N& sum : line)
        sum = number<N>(0.0);
    for (int j = 0; j <= Degree; ++j) {
        N of_z[Degree + 1];
        for (N& sum : of_z)
            sum = number<N>(0.0);
        for (int k = 0; k <= Degree; ++k) {
            const N coefficient = load(j, k);
            for (int m = 0; m <= Degree; ++m)
                of_z[m] = mul_add(z[k][m], coefficient, of_z[m]);
        }
        for (int p = 0; p <= Degree; ++p)
            for (int m = 0; m <= Degree; ++m)
                line[p + m] = mul_add(y[j][p], of_z[m], line[p + m]);
    }
    return line;
}

/// Adds the product of one weight of x and one contracted line.
template <int Degree, class N>
HWY_INLINE void contract_x(const std::array<N, Degree + 1>& x, const std::array<N, 2 * Degree + 1>& line,
                           Bernstein<3 * Degree, N>& scaled)
{
    for (int p = 0; p <= Degree; ++p)
        for (int q = 0; q <= 2 * Degree; ++q)
            scaled[p + q] = mul_add(x[p], line[q], scaled[p + q]);
}

/// f - level from local coordinates `entry` to `exit` of a cell: Bernstein coefficients times binomials, in [0, 1]
/// along the way; coefficient(i, j, k) is already less the threshold.
///
/// Along the segment the weights of each axis are polynomials of degree n. In scaled Bernstein form a product of
/// polynomials is the convolution of its factors, so the sum over the cell's coefficients is contracted axis by axis:
/// z, y, x. Every result is a convex combination of the cell's coefficients, times the binomial, so its
/// rounding error is small (docs/method.md).
template <int Degree, class Coefficients, class Point>
HWY_INLINE auto scaled_bernstein(const Coefficients& coefficient, const Point& entry, const Point& exit)
{
    using N = std::remove_cvref_t<decltype(entry[0])>;
    const auto x = segment_weights<Degree, N>(entry[0], exit[0]), y = segment_weights<Degree, N>(entry[1], exit[1]),
               z = segment_weights<Degree, N>(entry[2], exit[2]);
    Bernstein<3 * Degree, N> scaled;
    for (N& sum : scaled)
        sum = number<N>(0.0);
    for (int i = 0; i <= Degree; ++i) {
        const auto load = [&](int j, int k) HWY_ATTR { return in_lanes<N>(coefficient(i, j, k)); };
        contract_x<Degree>(x[i], contract_yz<Degree>(y, z, load), scaled);
    }
    return scaled;
}

/// The Bernstein coefficients themselves, in double precision. The first and the last equal those of the cells before
/// and behind, bit for bit: both sums begin with coefficients that the cells share, in the same order.
template <int Degree, class Coefficients>
HWY_INLINE Bernstein<3 * Degree> bernstein_along_segment(const Coefficients& coefficient, const glm::dvec3& entry,
                                                         const glm::dvec3& exit)
{
    Bernstein<3 * Degree> b = scaled_bernstein<Degree>(coefficient, entry, exit);
    for (int r = 0; r <= 3 * Degree; ++r)
        b[r] /= binomials<3 * Degree>[r];
    return b;
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
