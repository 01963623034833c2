// The steps that solve f = level along the segment of a ray in one cell: f as a polynomial of degree 3n in Bernstein
// form, what its coefficients prove about roots in spite of their rounding errors, and the roots in double precision.
// Included once for each SIMD target.
#include "isospline/cell/coefficients.h"
#include "isospline/cell/lattice_ray.h"
#include "isospline/cell/root_estimate-inl.h"
#include "isospline/cell/root_in_cell.h"
#include "isospline/cell/value-inl.h"
#include "isospline/math/bernstein.h"
#include "isospline/math/number-inl.h"
#include "isospline/math/roots-inl.h"
#include "isospline/spline/cell_weights-inl.h"

#include <glm/vec3.hpp>

#include <array>
#include <cmath>
#include <optional>
#include <type_traits>
#include <vector>

#if defined(ISOSPLINE_CELL_SOLVE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_SOLVE_INL_H
#undef ISOSPLINE_CELL_SOLVE_INL_H
#else
#define ISOSPLINE_CELL_SOLVE_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

// f along a straight segment inside one cell.

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

// A cell's coefficients less the threshold, copied together.

// A bound on the rounding error of the Bernstein coefficients of f - level along any segment in a cell, in single
// precision, from the largest magnitude of the cell's coefficients less the threshold; docs/method.md derives it.
template <int Degree, class V>
HWY_INLINE V rounding_error_of_bernstein(V magnitude, double threshold)
{
    constexpr float unit_roundoff = 0x1p-24f;
    constexpr float units = Degree <= 2 ? 33.0f : 77.0f, units_of_threshold = 1.01f;
    const V of_threshold = number<V>(units_of_threshold * std::abs(static_cast<float>(threshold)));
    return number<V>(unit_roundoff) * mul_add(number<V>(units), magnitude, of_threshold);
}

// The distance of rows in the copy, for every degree.
constexpr int local_row = 4;

template <int Degree, typename Real>
struct ReducedCoefficients {
    explicit HWY_INLINE ReducedCoefficients(const CellCoefficients& cell)
    {
        if constexpr (std::is_same_v<Real, float>)
            copy_in_single_precision(cell);
        else
            for (int k = 0; k <= Degree; ++k)
                for (int j = 0; j <= Degree; ++j)
                    for (int i = 0; i <= Degree; ++i)
                        values[index(i, j, k)] = cell(i, j, k);
    }

    HWY_INLINE Real operator()(int i, int j, int k) const { return values[index(i, j, k)]; }
    /// Aligned for vectors of a whole row; numbers behind the n+1 coefficients are zero in single precision.
    HWY_INLINE const Real* row(int j, int k) const { return values + index(0, j, k); }

    /// rounding_error_of_bernstein() of single precision.
    HWY_INLINE Real error() const { return error_; }

private:
    static constexpr int index(int i, int j, int k) { return (k * (Degree + 1) + j) * local_row + i; }

    HWY_INLINE void copy_in_single_precision(const CellCoefficients& cell)
    {
        const hn::CappedTag<float, local_row> d;
        constexpr int lanes = static_cast<int>(hn::MaxLanes(d));
        const auto threshold = hn::Set(d, static_cast<float>(cell.threshold));
        auto magnitudes = hn::Zero(d);
        for (int k = 0; k <= Degree; ++k)
            for (int j = 0; j <= Degree; ++j)
                for (int i = 0; i <= Degree; i += lanes) {
                    const auto used = hn::FirstN(d, static_cast<std::size_t>(Degree + 1 - i));
                    const auto reduced = hn::IfThenElseZero(used, hn::Sub(hn::LoadU(d, cell.row(j, k) + i), threshold));
                    hn::Store(reduced, d, values + index(i, j, k));
                    magnitudes = hn::Max(magnitudes, hn::Abs(reduced));
                }
        error_ = hn::GetLane(rounding_error_of_bernstein<Degree>(hn::MaxOfLanes(d, magnitudes), cell.threshold));
    }

    alignas(64) Real values[(Degree + 1) * (Degree + 1) * local_row];
    Real error_ = 0;
};

// What Bernstein coefficients prove about the roots of a polynomial, given their rounding error.

/// Where both are false, nothing is proven.
template <class N>
struct Verdict {
    MaskOf<N> no_root, one_root;
};

/// The verdict for scaled Bernstein coefficients, each with an error of at most `error` times its binomial. If all have
/// the same sign, there is no root. If one sign is followed by at most one coefficient of unknown sign, and then by the
/// other sign up to the end, there is exactly one root (Descartes' rule of signs).
template <int Order, class N>
HWY_INLINE Verdict<N> judge(const Bernstein<Order, N>& scaled, N error)
{
    const N zero = number<N>(0.0);
    const auto flip = less(scaled[0], zero);
    auto in_first = less(error, select(flip, negated(scaled[0]), scaled[0]));
    auto in_doubt = less(zero, zero), in_other = in_doubt; // nowhere yet
    for (int r = 1; r <= Order; ++r) {
        const N bound = error * number<N>(binomials<Order>[r]);
        const N value = select(flip, negated(scaled[r]), scaled[r]);
        const auto same = less(bound, value), other = less(value, negated(bound));
        in_other = both(either(in_first, either(in_doubt, in_other)), other);
        in_doubt = without(in_first, either(same, other));
        in_first = both(in_first, same);
    }
    return {in_first, in_other};
}

// The roots of a ray in a cell, scalar and in double precision: used where single precision cannot decide.

/// f - level along the segment of a ray that belongs to a cell. Its values at the ends equal those of the cells before
/// and behind, bit for bit.
template <int Degree>
Bernstein<3 * Degree> reference_polynomial(const CellCoefficients& cell, const LatticeRay& ray, const Interval& inside)
{
    return bernstein_along_segment<Degree>(cell, ray.local_end(inside.t_near, cell.lower),
                                           ray.local_end(inside.t_far, cell.lower));
}

/// Calls `visit(root, rising)` for the roots in a cell's segment that are within the ray's limits, in ascending order,
/// until it returns false.
template <int Degree, typename Visit>
void for_each_root_in_segment(const CellCoefficients& cell, const LatticeRay& ray, const Interval& inside,
                              const Visit& visit)
{
    for_each_root<3 * Degree>(reference_polynomial<Degree>(cell, ray, inside), [&](double s, bool rising) HWY_ATTR {
        const double end = inside.t_near + s * (inside.t_far - inside.t_near);
        const double t = end < inside.t_far ? end : inside.t_far;
        return !ray.is_within_limits(t) ||
               visit(RootInCell{t, gradient_in_cell<Degree>(cell, ray.at(t) - cell.lower)}, rising);
    });
}

/// The first root.
template <int Degree>
HWY_NOINLINE std::optional<RootInCell> first_reference_root(const CellCoefficients& cell, const LatticeRay& ray,
                                                            const Interval& inside)
{
    std::optional<RootInCell> first;
    for_each_root_in_segment<Degree>(cell, ray, inside, [&](const RootInCell& root, bool) {
        first = root;
        return false;
    });
    return first;
}

/// Appends all roots.
template <int Degree>
HWY_NOINLINE void all_reference_roots(const CellCoefficients& cell, const LatticeRay& ray, const Interval& inside,
                                      std::vector<CrossingInCell>& crossings)
{
    for_each_root_in_segment<Degree>(cell, ray, inside, [&](const RootInCell& root, bool rising) {
        crossings.push_back({root, rising});
        return true;
    });
}

// Refines the approximate root of a ray in a cell.

/// Rays with exactly one root in [t_near, t_far] each, one ray per lane; t is near the root, and slope is about the
/// derivative of f with respect to t there.
template <class V>
struct RootSearch {
    /// Starts from the root of single precision, between t_near and t_far.
    HWY_INLINE void begin(V near_limit, V far_limit, RootEstimate<V> estimate)
    {
        t_near = near_limit;
        t_far = far_limit;
        const V way = t_far - t_near;
        t = mul_add(estimate.s, way, t_near);
        slope = estimate.slope / way;
    }

    template <class Corner>
    HWY_INLINE std::array<V, 3> local(const Corner& lower) const
    {
        const auto along = [&](int axis)
                               HWY_ATTR { return origin[axis] + t * direction[axis] - in_lanes<V>(lower[axis]); };
        return {along(0), along(1), along(2)};
    }

    std::array<V, 3> origin, direction;
    V t_near, t_far, t, slope;
    std::array<V, 3> gradient;
};

/// Newton's method in double precision, with the given slope in the first step, until a step is below 1e-12 of a voxel,
/// or the one before was below 1e-9: then the next would be below rounding, and the gradient is that of the root.
/// `cell` has value(local) and value_and_gradient(local); its corner is `lower`, in all lanes or for each one. Returns
/// the wanted lanes where it converges within [t_near, t_far]; lanes that do not converge do not delay the others.
template <class V, class Cell, class Corner>
HWY_INLINE MaskOf<V> refine_root(const Cell& cell, const Corner& lower, MaskOf<V> wanted, RootSearch<V>& search)
{
    constexpr int iteration_limit = 6;
    const hn::DFromV<V> d;
    V speed = hn::Zero(d);
    for (int axis = 0; axis < 3; ++axis) {
        speed = hn::Max(speed, hn::Abs(search.direction[axis]));
        search.gradient[axis] = hn::Zero(d);
    }
    search.t = search.t - cell.value(search.local(lower)) / search.slope;
    auto done = hn::Not(wanted), was_near = hn::Xor(wanted, wanted);
    for (int iteration = 0; iteration < iteration_limit; ++iteration) {
        const auto [value, gradient] = cell.value_and_gradient(search.local(lower));
        V slope = gradient[0] * search.direction[0];
        slope = mul_add(gradient[1], search.direction[1], slope);
        slope = mul_add(gradient[2], search.direction[2], slope);
        const V step = value / slope;
        search.t = select(done, search.t, search.t - step);
        for (int axis = 0; axis < 3; ++axis)
            search.gradient[axis] = select(done, search.gradient[axis], gradient[axis]);
        const V way = hn::Abs(step) * speed;
        done = either(done, either(was_near, less_equal(way, number<V>(1e-12))));
        was_near = less_equal(way, number<V>(1e-9));
        if (hn::AllTrue(d, done))
            break;
    }
    return both(both(done, wanted), both(less_equal(search.t_near, search.t), less_equal(search.t, search.t_far)));
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
