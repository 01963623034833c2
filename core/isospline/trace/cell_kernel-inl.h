// SIMD building blocks of the cell intersectors, for any number of lanes; included once for each target.
//
// A lane goes through the same operations in the same order whatever the number of lanes: forms of the intersector that
// lay out their lanes differently find the same roots, bit for bit.
#include "isospline/math/bernstein.h"
#include "isospline/trace/cell_block.h"

#include <hwy/highway.h>

#include <cmath>

#if defined(ISOSPLINE_TRACE_CELL_KERNEL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_CELL_KERNEL_INL_H
#undef ISOSPLINE_TRACE_CELL_KERNEL_INL_H
#else
#define ISOSPLINE_TRACE_CELL_KERNEL_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Rows of a cell's coefficients, less the threshold, are four apart here whatever the degree.
constexpr int local_row = 4;

template <int Degree>
constexpr int local_count = (Degree + 1) * (Degree + 1) * local_row;

// Copies the coefficients of a cell, less the threshold, in single precision. Returns a bound on the rounding error of
// the Bernstein coefficients of f - level along any segment in the cell; docs/method.md derives it.
template <int Degree>
HWY_INLINE float LoadReduced(const CellBlock& cell, float* HWY_RESTRICT coefficients)
{
    const hn::CappedTag<float, local_row> d;
    constexpr int lanes = static_cast<int>(hn::MaxLanes(d));
    const auto threshold = hn::Set(d, static_cast<float>(cell.threshold));
    auto magnitudes = hn::Zero(d);
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j) {
            const float* row = cell.coefficients + j * cell.row_stride + k * cell.slice_stride;
            float* reduced_row = coefficients + (k * (Degree + 1) + j) * local_row;
            for (int i = 0; i <= Degree; i += lanes) {
                const auto used = hn::FirstN(d, static_cast<std::size_t>(Degree + 1 - i));
                const auto reduced = hn::IfThenElseZero(used, hn::Sub(hn::LoadU(d, row + i), threshold));
                hn::Store(reduced, d, reduced_row + i);
                magnitudes = hn::Max(magnitudes, hn::Abs(reduced));
            }
        }
    constexpr float unit_roundoff = 0x1p-24f;
    constexpr float units = Degree <= 2 ? 64.0f : 128.0f;
    const float magnitude = hn::GetLane(hn::MaxOfLanes(d, magnitudes));
    return unit_roundoff * (units * magnitude + 2.0f * std::abs(static_cast<float>(cell.threshold)));
}

// The same in double precision.
template <int Degree>
HWY_INLINE void LoadReduced(const CellBlock& cell, double* HWY_RESTRICT coefficients)
{
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j) {
            const float* row = cell.coefficients + j * cell.row_stride + k * cell.slice_stride;
            for (int i = 0; i <= Degree; ++i)
                coefficients[(k * (Degree + 1) + j) * local_row + i] = static_cast<double>(row[i]) - cell.threshold;
        }
}

// segment_weights() of ray_polynomial.h, one segment a lane.
template <int Degree, class D, class V>
HWY_INLINE void SegmentWeights(D d, V a, V e, V (&w)[Degree + 1][Degree + 1])
{
    const V one = hn::Set(d, 1.0f);
    const V va = hn::Sub(one, a), ve = hn::Sub(one, e);
    if constexpr (Degree == 1) {
        w[0][0] = va;
        w[0][1] = ve;
        w[1][0] = a;
        w[1][1] = e;
    } else if constexpr (Degree == 2) {
        const V half = hn::Set(d, 0.5f);
        w[0][0] = hn::Mul(hn::Mul(half, va), va);
        w[0][1] = hn::Mul(va, ve);
        w[0][2] = hn::Mul(hn::Mul(half, ve), ve);
        w[1][0] = hn::MulAdd(a, va, half);
        w[1][1] = hn::MulAdd(a, ve, hn::MulAdd(e, va, one));
        w[1][2] = hn::MulAdd(e, ve, half);
        w[2][0] = hn::Mul(hn::Mul(half, a), a);
        w[2][1] = hn::Mul(a, e);
        w[2][2] = hn::Mul(hn::Mul(half, e), e);
    } else {
        static_assert(Degree == 3);
        const V half = hn::Set(d, 0.5f), sixth = hn::Set(d, 1.0f / 6.0f);
        const auto outer = [&](V x, V y, V(&row)[4]) HWY_ATTR {
            const V xx = hn::Mul(x, x), yy = hn::Mul(y, y);
            row[0] = hn::Mul(hn::Mul(sixth, x), xx);
            row[1] = hn::Mul(hn::Mul(half, y), xx);
            row[2] = hn::Mul(hn::Mul(half, x), yy);
            row[3] = hn::Mul(hn::Mul(sixth, y), yy);
        };
        const auto inner = [&](V x, V y, V(&row)[4]) HWY_ATTR {
            const V xx = hn::Mul(x, x), yy = hn::Mul(y, y), two = hn::Set(d, 2.0f),
                    two_thirds = hn::Set(d, 2.0f / 3.0f);
            const V three_halves = hn::Set(d, 1.5f);
            const V mixed = hn::NegMulAdd(hn::Mul(two, x), y, two);
            row[0] = hn::MulAdd(xx, hn::MulSub(half, x, one), two_thirds);
            row[1] = hn::MulAdd(xx, hn::MulSub(three_halves, y, one), mixed);
            row[2] = hn::MulAdd(yy, hn::MulSub(three_halves, x, one), mixed);
            row[3] = hn::MulAdd(yy, hn::MulSub(half, y, one), two_thirds);
        };
        outer(va, ve, w[0]);
        inner(a, e, w[1]);
        inner(va, ve, w[2]);
        outer(a, e, w[3]);
    }
}

// One line of the sum in bernstein_along_segment(): y and z contracted, for the coefficients at `coefficients`, which
// are `Stride` values a lane apart from the next plane. `load` makes a vector of the coefficient of row j and slice k.
template <int Degree, class D, class V, class Load>
HWY_INLINE void ContractYZ(D d, const V (&wy)[Degree + 1][Degree + 1], const V (&wz)[Degree + 1][Degree + 1],
                           const Load& load, V (&y)[2 * Degree + 1])
{
    for (V& sum : y)
        sum = hn::Zero(d);
    for (int j = 0; j <= Degree; ++j) {
        V z[Degree + 1];
        for (V& sum : z)
            sum = hn::Zero(d);
        for (int k = 0; k <= Degree; ++k) {
            const V coefficient = load(j, k);
            for (int m = 0; m <= Degree; ++m)
                z[m] = hn::MulAdd(wz[k][m], coefficient, z[m]);
        }
        for (int p = 0; p <= Degree; ++p)
            for (int m = 0; m <= Degree; ++m)
                y[p + m] = hn::MulAdd(wy[j][p], z[m], y[p + m]);
    }
}

// Adds the product of one weight of x and one line that is contracted.
template <int Degree, class V>
HWY_INLINE void ContractX(const V (&wx)[Degree + 1], const V (&y)[2 * Degree + 1], V (&scaled)[3 * Degree + 1])
{
    for (int p = 0; p <= Degree; ++p)
        for (int q = 0; q <= 2 * Degree; ++q)
            scaled[p + q] = hn::MulAdd(wx[p], y[q], scaled[p + q]);
}

// About where a polynomial has its root, and its derivative there.
template <class V>
struct RootEstimate {
    V s, slope;
};

// The root in [0, 1] of polynomials in scaled Bernstein form that have exactly one: Newton's method on the monomial
// form, kept inside a shrinking bracket, from where the control polygon crosses zero. Good for a start in double
// precision, no more.
template <int Order, class D, class V>
HWY_INLINE RootEstimate<V> EstimateRoot(D d, const V (&scaled)[Order + 1])
{
    const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    V b[Order + 1];
    for (int r = 0; r <= Order; ++r)
        b[r] = hn::Mul(scaled[r], hn::Set(d, static_cast<float>(1.0 / binomials<Order>[r])));
    const auto negative_at_0 = hn::Lt(b[0], zero);

    // The two control points of opposite signs; there is one such pair.
    V before = b[0], after = b[1], first = zero;
    for (int r = 1; r < Order; ++r) {
        const auto crosses = hn::Xor(hn::Lt(b[r], zero), hn::Lt(b[r + 1], zero));
        before = hn::IfThenElse(crosses, b[r], before);
        after = hn::IfThenElse(crosses, b[r + 1], after);
        first = hn::IfThenElse(crosses, hn::Set(d, static_cast<float>(r)), first);
    }
    V s = hn::Mul(hn::Add(first, hn::Div(before, hn::Sub(before, after))), hn::Set(d, 1.0f / Order));

    // Monomial coefficients: the k-th forward differences times C(Order, k).
    for (int k = 1; k <= Order; ++k)
        for (int r = Order; r >= k; --r)
            b[r] = hn::Sub(b[r], b[r - 1]);
    for (int k = 1; k < Order; ++k)
        b[k] = hn::Mul(b[k], hn::Set(d, static_cast<float>(binomials<Order>[k])));

    V lower = zero, upper = one, slope = zero;
    constexpr int steps = 2;
    for (int step = 0;; ++step) {
        V value = b[Order];
        slope = zero;
        for (int k = Order - 1; k >= 0; --k) {
            slope = hn::MulAdd(slope, s, value);
            value = hn::MulAdd(value, s, b[k]);
        }
        if (step == steps)
            break;
        const auto right_of_root = hn::Xor(hn::Lt(value, zero), negative_at_0);
        lower = hn::IfThenElse(right_of_root, lower, s);
        upper = hn::IfThenElse(right_of_root, s, upper);
        const V newton = hn::Sub(s, hn::Div(value, slope));
        const auto inside = hn::And(hn::Ge(newton, lower), hn::Le(newton, upper));
        s = hn::IfThenElse(inside, newton, hn::Mul(hn::Set(d, 0.5f), hn::Add(lower, upper)));
    }
    return {s, slope};
}

// Weights of the n+1 coefficients along one axis at local coordinates u, and their derivatives.
template <int Degree, class D, class V>
HWY_INLINE void PointWeights(D d, V u, V (&w)[Degree + 1], V (&dw)[Degree + 1])
{
    const V one = hn::Set(d, 1.0);
    const V v = hn::Sub(one, u);
    if constexpr (Degree == 1) {
        w[0] = v;
        w[1] = u;
        dw[0] = hn::Neg(one);
        dw[1] = one;
    } else if constexpr (Degree == 2) {
        const V half = hn::Set(d, 0.5);
        w[0] = hn::Mul(hn::Mul(half, v), v);
        w[1] = hn::MulAdd(u, v, half);
        w[2] = hn::Mul(hn::Mul(half, u), u);
        dw[0] = hn::Neg(v);
        dw[1] = hn::Sub(v, u);
        dw[2] = u;
    } else {
        static_assert(Degree == 3);
        const V half = hn::Set(d, 0.5), sixth = hn::Set(d, 1.0 / 6.0), two_thirds = hn::Set(d, 2.0 / 3.0);
        const V uu = hn::Mul(u, u), vv = hn::Mul(v, v);
        w[0] = hn::Mul(hn::Mul(sixth, v), vv);
        w[1] = hn::MulAdd(uu, hn::MulSub(half, u, one), two_thirds);
        w[2] = hn::MulAdd(vv, hn::MulSub(half, v, one), two_thirds);
        w[3] = hn::Mul(hn::Mul(sixth, u), uu);
        const V two = hn::Set(d, 2.0), three_halves = hn::Set(d, 1.5);
        dw[0] = hn::Neg(hn::Mul(half, vv));
        dw[1] = hn::Mul(u, hn::MulSub(three_halves, u, two));
        dw[2] = hn::Neg(hn::Mul(v, hn::MulSub(three_halves, v, two)));
        dw[3] = hn::Mul(half, uu);
    }
}

// f - level at local coordinates of a cell.
template <int Degree, class D, class V>
HWY_INLINE V Value(D d, const double* HWY_RESTRICT coefficients, const V (&local)[3])
{
    V x[Degree + 1], y[Degree + 1], z[Degree + 1], unused[Degree + 1];
    PointWeights<Degree>(d, local[0], x, unused);
    PointWeights<Degree>(d, local[1], y, unused);
    PointWeights<Degree>(d, local[2], z, unused);
    V value = hn::Zero(d);
    for (int k = 0; k <= Degree; ++k) {
        V plane = hn::Zero(d);
        for (int j = 0; j <= Degree; ++j) {
            const double* row = coefficients + (k * (Degree + 1) + j) * local_row;
            V line = hn::Mul(x[0], hn::Set(d, row[0]));
            for (int i = 1; i <= Degree; ++i)
                line = hn::MulAdd(x[i], hn::Set(d, row[i]), line);
            plane = hn::MulAdd(y[j], line, plane);
        }
        value = hn::MulAdd(z[k], plane, value);
    }
    return value;
}

// f - level and the gradient of f, by lattice coordinates, at local coordinates of a cell.
template <int Degree, class D, class V>
HWY_INLINE V ValueAndGradient(D d, const double* HWY_RESTRICT coefficients, const V (&local)[3], V (&gradient)[3])
{
    V x[Degree + 1], y[Degree + 1], z[Degree + 1], dx[Degree + 1], dy[Degree + 1], dz[Degree + 1];
    PointWeights<Degree>(d, local[0], x, dx);
    PointWeights<Degree>(d, local[1], y, dy);
    PointWeights<Degree>(d, local[2], z, dz);
    V value = hn::Zero(d);
    for (V& component : gradient)
        component = hn::Zero(d);
    for (int k = 0; k <= Degree; ++k) {
        // Of one plane: the value, and the derivatives by x and y.
        V plane = hn::Zero(d), plane_dx = hn::Zero(d), plane_dy = hn::Zero(d);
        for (int j = 0; j <= Degree; ++j) {
            const double* row = coefficients + (k * (Degree + 1) + j) * local_row;
            V line = hn::Mul(x[0], hn::Set(d, row[0])), line_dx = hn::Mul(dx[0], hn::Set(d, row[0]));
            for (int i = 1; i <= Degree; ++i) {
                line = hn::MulAdd(x[i], hn::Set(d, row[i]), line);
                line_dx = hn::MulAdd(dx[i], hn::Set(d, row[i]), line_dx);
            }
            plane = hn::MulAdd(y[j], line, plane);
            plane_dx = hn::MulAdd(y[j], line_dx, plane_dx);
            plane_dy = hn::MulAdd(dy[j], line, plane_dy);
        }
        value = hn::MulAdd(z[k], plane, value);
        gradient[0] = hn::MulAdd(z[k], plane_dx, gradient[0]);
        gradient[1] = hn::MulAdd(z[k], plane_dy, gradient[1]);
        gradient[2] = hn::MulAdd(dz[k], plane, gradient[2]);
    }
    return value;
}

// Rays that have exactly one root in [t_near, t_far] each; t is near it, and slope about the derivative of f by t
// there.
template <class V>
struct RootSearch {
    // Begins where single precision has the root, on the way from t_near to t_far.
    HWY_INLINE void begin(V near_limit, V far_limit, RootEstimate<V> estimate)
    {
        t_near = near_limit;
        t_far = far_limit;
        const V way = hn::Sub(t_far, t_near);
        t = hn::MulAdd(estimate.s, way, t_near);
        slope = hn::Div(estimate.slope, way);
    }

    template <class D>
    HWY_INLINE void local(D d, const glm::dvec3& lower, V (&coordinates)[3]) const
    {
        for (int axis = 0; axis < 3; ++axis)
            coordinates[axis] = hn::Sub(hn::Add(origin[axis], hn::Mul(t, direction[axis])), hn::Set(d, lower[axis]));
    }

    V origin[3], direction[3];
    V t_near, t_far, t, slope;
    V gradient[3];
};

// Newton's method in double precision, the first step with the slope that is given, until a step is below 1e-9 of a
// voxel: the step after would be below rounding, and the gradient is that of the root. Returns the wanted lanes where
// it arrives, within [t_near, t_far]; others do not hold these up.
template <int Degree, class D, class V>
HWY_INLINE hn::Mask<D> RefineRoot(D d, const double* HWY_RESTRICT coefficients, const glm::dvec3& lower,
                                  hn::Mask<D> wanted, RootSearch<V>& search)
{
    constexpr int iteration_limit = 5;
    V speed = hn::Zero(d);
    for (int axis = 0; axis < 3; ++axis) {
        speed = hn::Max(speed, hn::Abs(search.direction[axis]));
        search.gradient[axis] = hn::Zero(d);
    }
    V local[3], gradient[3];
    search.local(d, lower, local);
    search.t = hn::Sub(search.t, hn::Div(Value<Degree>(d, coefficients, local), search.slope));
    auto done = hn::Not(wanted);
    for (int iteration = 0; iteration < iteration_limit; ++iteration) {
        search.local(d, lower, local);
        const V value = ValueAndGradient<Degree>(d, coefficients, local, gradient);
        V slope = hn::Mul(gradient[0], search.direction[0]);
        slope = hn::MulAdd(gradient[1], search.direction[1], slope);
        slope = hn::MulAdd(gradient[2], search.direction[2], slope);
        const V step = hn::Div(value, slope);
        search.t = hn::IfThenElse(done, search.t, hn::Sub(search.t, step));
        for (int axis = 0; axis < 3; ++axis)
            search.gradient[axis] = hn::IfThenElse(done, search.gradient[axis], gradient[axis]);
        done = hn::Or(done, hn::Le(hn::Mul(hn::Abs(step), speed), hn::Set(d, 1e-9)));
        if (hn::AllTrue(d, done))
            break;
    }
    return hn::And(hn::And(done, wanted), hn::And(hn::Ge(search.t, search.t_near), hn::Le(search.t, search.t_far)));
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif // ISOSPLINE_TRACE_CELL_KERNEL_INL_H
