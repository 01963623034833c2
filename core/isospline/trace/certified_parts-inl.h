// f along parts of lines, each in its own cell, as polynomials with bounds; SIMD lanes are the parts: docs/method.md,
// "Certified rays". Included once for each SIMD target.
#include "isospline/math/bernstein.h"
#include "isospline/shell/isosurface.h"
#include "isospline/spline/coefficient_view.h"
#include "isospline/trace/certified_lines-inl.h"
#include "isospline/trace/certified_walk-inl.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <type_traits>

#if defined(ISOSPLINE_TRACE_CERTIFIED_PARTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_CERTIFIED_PARTS_INL_H
#undef ISOSPLINE_TRACE_CERTIFIED_PARTS_INL_H
#else
#define ISOSPLINE_TRACE_CERTIFIED_PARTS_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// certified::polar_weights() in lanes.
template <int Degree, int Ends, class N>
HWY_INLINE std::array<N, Degree + 1> polar_weights(N start, N end)
{
    constexpr std::array<double, 4> over{0.0, 1.0, 1.0 / 2.0, 1.0 / 3.0};
    std::array<N, Degree + 1> weights;
    weights[0] = number<N>(1.0);
    for (int step = Degree; step >= 1; --step) {
        const N at = step > Degree - Ends ? end : start;
        const int count = Degree - step + 1;
        N carried = number<N>(0.0);
        for (int i = 0; i < count; ++i) {
            const auto item = static_cast<std::size_t>(i);
            const N share = weights[item] * number<N>(over[static_cast<std::size_t>(count)]);
            weights[item] = carried + share * (number<N>(1.0 + i) - at);
            carried = share * (at - number<N>(1.0 + i - count));
        }
        weights[static_cast<std::size_t>(count)] = carried;
    }
    return weights;
}

/// The polynomial on [0, s]: certified::piece_before() in lanes.
template <int Order, class N>
HWY_INLINE Bernstein<Order, N> piece_before(Bernstein<Order, N> b, N s)
{
    const N rest = number<N>(1.0) - s;
    Bernstein<Order, N> piece;
    for (std::size_t i = 0; i < Order; ++i) {
        piece[i] = b[0];
        for (std::size_t j = 0; j < Order - i; ++j)
            b[j] = mul_add(s, b[j + 1], rest * b[j]);
    }
    piece[Order] = b[0];
    return piece;
}

/// Splits a polynomial at s = 1/2: split_in_half() in lanes.
template <int Order, class N>
HWY_INLINE void split_in_lanes(Bernstein<Order, N> b, Bernstein<Order, N>& left, Bernstein<Order, N>& right)
{
    for (std::size_t i = 0; i <= Order; ++i) {
        left[i] = b[0];
        right[Order - i] = b[Order - i];
        for (std::size_t j = 0; j < Order - i; ++j)
            b[j] = number<N>(0.5) * (b[j] + b[j + 1]);
    }
}

/// The sign of a number beyond its error: 1 or -1, 0 if it is not.
template <class N>
HWY_INLINE N proven_sign(N value, N error)
{
    return select(less(error, absolute(value)), with_sign_of(number<N>(1.0), value), number<N>(0.0));
}

using CertifiedSingles = hn::CappedTag<float, 2 * certified_width>;

/// As many parts as vectors of the tag D have lanes, in its precision.
template <int Degree, class D = CertifiedDoubles>
class CertifiedParts {
public:
    using N = hn::Vec<D>;
    static constexpr int order = 3 * Degree;

    /// The parts of a list from `first` on; those beyond its end are repeated.
    CertifiedParts(const IsosurfaceSnapshot& surface, const certified::Placement& placement,
                   const CertifiedPartList& parts, std::size_t first)
    {
        for (std::size_t i = 0; i < width; ++i) {
            std::array<float, 64> own; // coefficients of a volume that has none in memory
            const CoefficientView cell = surface.volume().cell(parts.cell_of(first + i), own.data());
            for (std::ptrdiff_t k = 0; k <= Degree; ++k)
                for (std::ptrdiff_t j = 0; j <= Degree; ++j)
                    std::memcpy(rows_[k][j][i], cell.first + j * cell.row_stride + k * cell.slice_stride,
                                sizeof(rows_[k][j][i]));
        }
        N beside = number<N>(0.0);
        Vector3<N> begin, end;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            begin[axis] = clamped(load(parts[CertifiedPartList::local_begin + axis] + first), beside);
            end[axis] = clamped(load(parts[CertifiedPartList::local_end + axis] + first), beside);
        }
        // The places of both ends are rounded to the precision, and so is the threshold.
        beside = beside + number<N>(6.0 * unit);
        const double threshold = surface.threshold();
        const N rounding = number<N>(std::abs(threshold - static_cast<double>(static_cast<Real>(threshold))));
        set_polynomial(begin, end, number<N>(threshold));
        error_ = (load(parts[CertifiedPartList::value_error] + first) +
                  number<N>(placement.slope * (1.0 + 0x1p-20)) * beside + rounding + polynomial_error()) *
                 number<N>(1.0 + 64.0 * unit);
    }

    /// f - threshold, from t_begin to t_end.
    const Bernstein<order, N>& polynomial() const { return polynomial_; }
    /// A bound on all errors of the polynomial and of pieces of it.
    N error() const { return error_; }
    /// The part of the bound that comes from rounding in the polynomial: certified::polynomial_error().
    N polynomial_error() const { return number<N>(256.0 * unit) * magnitude_ + number<N>(underflow); }
    /// The largest distance of a coefficient from the threshold.
    N magnitude() const { return magnitude_; }
    /// The coefficients of a row along x less the threshold.
    HWY_INLINE std::array<N, Degree + 1> row(std::size_t j, std::size_t k, N threshold) const
    {
        const hn::Rebind<float, D> singles;
        hn::Vec<decltype(singles)> all[4];
        hn::LoadInterleaved4(singles, rows_[k][j][0], all[0], all[1], all[2], all[3]);
        std::array<N, Degree + 1> row;
        for (std::size_t i = 0; i <= Degree; ++i) {
            if constexpr (std::is_same_v<Real, float>)
                row[i] = all[i] - threshold;
            else
                row[i] = hn::PromoteTo(D(), all[i]) - threshold;
        }
        return row;
    }

    /// The sign of f on the whole part; 0 if none is proven.
    HWY_INLINE N side() const
    {
        N side = side_of(polynomial_);
        if constexpr (std::is_same_v<Real, double>) { // in quarters
            Bernstein<order, N> halves[2], quarters[2];
            split_in_lanes<order>(polynomial_, halves[0], halves[1]);
            N of_quarters = with_sign_of(number<N>(1.0), polynomial_[0]);
            for (const auto& half : halves) {
                split_in_lanes<order>(half, quarters[0], quarters[1]);
                for (const auto& quarter : quarters)
                    of_quarters = select(equal(side_of(quarter), of_quarters), of_quarters, number<N>(0.0));
            }
            side = select(equal(side, number<N>(0.0)), of_quarters, side);
        }
        return side;
    }

private:
    using Real = hn::TFromD<D>;
    using Row = std::array<N, Degree + 1>;
    static constexpr std::size_t width = hn::MaxLanes(D()), count = Degree + 1;
    static constexpr double unit = std::numeric_limits<Real>::epsilon() / 2.0; ///< the unit roundoff
    static constexpr double underflow = std::is_same_v<Real, float> ? 0x1p-100 : 0x1p-900;

    HWY_INLINE static N load(const double* numbers)
    {
        const D d;
        if constexpr (std::is_same_v<Real, double>) {
            return hn::LoadU(d, numbers);
        } else {
            alignas(64) float singles[width];
            for (std::size_t i = 0; i < width; ++i)
                singles[i] = static_cast<float>(numbers[i]);
            return hn::Load(d, singles);
        }
    }

    HWY_INLINE N side_of(const Bernstein<order, N>& b) const
    {
        N least = b[0], most = b[0];
        for (std::size_t i = 1; i <= order; ++i) {
            least = smaller(b[i], least);
            most = larger(b[i], most);
        }
        const N below = select(less(most, negated(error_)), number<N>(-1.0), number<N>(0.0));
        return select(less(error_, least), number<N>(1.0), below);
    }

    /// The nearest number in [0, 1]; adds its distance to `beside`.
    HWY_INLINE static N clamped(N place, N& beside)
    {
        const N within = smaller(larger(place, number<N>(0.0)), number<N>(1.0));
        beside = beside + absolute(place - within);
        return within;
    }

    /// Along the segment, the weights of each axis are polynomials, whose products and sums give f.
    HWY_INLINE void set_polynomial(const Vector3<N>& first, const Vector3<N>& last, N threshold)
    {
        // Bernstein coefficients times binomials: those of a product are sums of products.
        std::array<std::array<Row, count>, 3> weights;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            weights[axis][0] = polar_weights<Degree, 0>(first[axis], last[axis]);
            weights[axis][1] = polar_weights<Degree, 1>(first[axis], last[axis]);
            if constexpr (Degree >= 2)
                weights[axis][2] = polar_weights<Degree, 2>(first[axis], last[axis]);
            if constexpr (Degree >= 3)
                weights[axis][3] = polar_weights<Degree, 3>(first[axis], last[axis]);
            for (std::size_t p = 1; p < Degree; ++p)
                for (N& each : weights[axis][p])
                    each = each * number<N>(binomials<Degree>[p]);
        }
        const N zero = number<N>(0.0);
        magnitude_ = zero;
        polynomial_.fill(zero);
        for (std::size_t k = 0; k < count; ++k) {
            Bernstein<2 * Degree, N> plane;
            plane.fill(zero);
            for (std::size_t j = 0; j < count; ++j) {
                const Row numbers = row(j, k, threshold);
                for (const N& each : numbers)
                    magnitude_ = larger(absolute(each), magnitude_);
                for (std::size_t p = 0; p < count; ++p) {
                    N line = weights[0][p][0] * numbers[0];
                    for (std::size_t i = 1; i < count; ++i)
                        line = mul_add(weights[0][p][i], numbers[i], line);
                    for (std::size_t q = 0; q < count; ++q)
                        plane[p + q] = mul_add(weights[1][q][j], line, plane[p + q]);
                }
            }
            for (std::size_t p = 0; p <= 2 * Degree; ++p)
                for (std::size_t r = 0; r < count; ++r)
                    polynomial_[p + r] = mul_add(weights[2][r][k], plane[p], polynomial_[p + r]);
        }
        for (std::size_t i = 0; i <= order; ++i)
            polynomial_[i] = polynomial_[i] * number<N>(1.0 / binomials<order>[i]);
    }

    alignas(64) float rows_[count][count][width][4]; ///< four floats may be read, of any degree
    N magnitude_, error_;
    Bernstein<order, N> polynomial_;
};

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
