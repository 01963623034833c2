// The approximate root in [0, 1] of a polynomial whose Bernstein coefficients change sign once, to start a search in
// double precision. The polynomial is sampled at s = 1/8, 2/8, ..., 1: a sample does not wait for another one, as the
// steps of an iteration do. The cubic polynomial through four samples leads to the root, and a step of Newton's method
// from there is as near to it as rounding allows. Included once for each SIMD target.
#include "isospline/cell/lane_mask-inl.h"
#include "isospline/math/bernstein.h"
#include "isospline/math/number-inl.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>

#if defined(ISOSPLINE_CELL_ROOT_ESTIMATE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_ROOT_ESTIMATE_INL_H
#undef ISOSPLINE_CELL_ROOT_ESTIMATE_INL_H
#else
#define ISOSPLINE_CELL_ROOT_ESTIMATE_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

constexpr int root_sample_count = 8;

/// Item [r][i] is s^r (1 - s)^(Order - r) for sample i, s = (i + 1) / 8: the factor of scaled coefficient r.
template <int Order>
struct RootSampleFactors {
    constexpr RootSampleFactors() : of()
    {
        for (int i = 0; i < root_sample_count; ++i) {
            const double s = (i + 1.0) / root_sample_count;
            for (int r = 0; r <= Order; ++r) {
                double factor = 1.0;
                for (int p = 0; p < Order; ++p)
                    factor *= p < r ? s : 1.0 - s;
                of[r][i] = static_cast<float>(factor);
            }
        }
    }

    alignas(64) float of[Order + 1][root_sample_count];
};
template <int Order>
inline constexpr RootSampleFactors<Order> root_sample_factors{};

/// The approximate root, and the derivative where the last step to it began.
template <class V>
struct RootEstimate {
    V s, slope;
};

/// A better approximation by one step of Newton's method on the polynomial with scaled Bernstein coefficients.
template <int Order, class V>
HWY_INLINE RootEstimate<V> improve_root(V s, const Bernstein<Order, V>& scaled)
{
    const V zero = number<V>(0.0), one = number<V>(1.0);
    // The sum of scaled[r] s^r (1 - s)^(Order - r) by Horner's rule, and the derivative of each of its steps.
    const V left = one - s;
    V power = one, value = scaled[0], slope = zero;
    for (int r = 1; r <= Order; ++r) {
        slope = mul_add(number<V>(r) * scaled[r], power, mul_sub(slope, left, value));
        power = power * s;
        value = mul_add(scaled[r], power, value * left);
    }
    return {hn::Min(hn::Max(s - value / slope, zero), one), slope};
}

/// Where the cubic polynomial through four samples changes sign, in steps from the first one: from the zero of the
/// secant, by one step of Newton's method.
template <class V>
HWY_INLINE V zero_of_cubic(const std::array<V, 4>& w)
{
    const V zero = number<V>(0.0), one = number<V>(1.0), half = number<V>(0.5);
    const auto negative = less(w[0], zero);
    const auto in_first = differ(less(w[1], zero), negative), not_in_last = differ(less(w[2], zero), negative);
    const V before = select(in_first, w[0], select(not_in_last, w[1], w[2]));
    const V after = select(in_first, w[1], select(not_in_last, w[2], w[3]));
    const V begin = select(in_first, zero, select(not_in_last, one, number<V>(2.0)));
    const V s = begin + before / (before - after);
    // Newton's form with forward differences: a + b s + c s (s - 1) / 2 + e s (s - 1) (s - 2) / 6.
    const V a = w[0], b = w[1] - w[0], b1 = w[2] - w[1], b2 = w[3] - w[2];
    const V c = half * (b1 - b), e = number<V>(1.0 / 6.0) * ((b2 - b1) - (b1 - b));
    const V s1 = s - one, s2 = s - number<V>(2.0);
    const V of_c = s * s1;
    const V value = mul_add(e, of_c * s2, mul_add(c, of_c, mul_add(b, s, a)));
    const V slope = mul_add(e, mul_add(s1, s2, mul_add(s, s2, of_c)), mul_add(c, s + s1, b));
    return hn::Min(hn::Max(s - value / slope, begin), begin + one);
}

/// The approximate root from scaled Bernstein coefficients; lanes are polynomials.
template <int Order, class V>
HWY_INLINE RootEstimate<V> estimate_root(const Bernstein<Order, V>& scaled)
{
    const V zero = number<V>(0.0);
    const auto negative = less(scaled[0], zero);
    std::array<V, 4> latest{zero, zero, zero, scaled[0]}, samples = latest; // around the root, when it is found
    V first = zero;
    auto has_crossed = less(zero, zero), is_found = has_crossed;
    for (int i = 0; i < root_sample_count; ++i) {
        V next = scaled[0] * number<V>(root_sample_factors<Order>.of[0][i]);
        for (int r = 1; r <= Order; ++r)
            next = mul_add(scaled[r], number<V>(root_sample_factors<Order>.of[r][i]), next);
        latest = {latest[1], latest[2], latest[3], next};
        if (i >= 2) {
            for (int j = 0; j < 4; ++j)
                samples[j] = select(is_found, samples[j], latest[j]);
            first = select(is_found, first, number<V>(i - 2));
            is_found = has_crossed;
        }
        has_crossed = either(has_crossed, differ(less(next, zero), negative));
    }
    const V s = (first + zero_of_cubic(samples)) * number<V>(1.0 / root_sample_count);
    return improve_root<Order>(s, scaled);
}

/// The same numbers for one polynomial; lanes are samples.
template <int Order, class One>
HWY_INLINE RootEstimate<float> estimate_one_root(const Bernstein<Order, One>& scaled)
{
    const hn::CappedTag<float, root_sample_count> d;
    const hn::DFromV<One> one;
    const auto spread = [d](One number) HWY_ATTR { return hn::Set(d, hn::GetLane(number)); };
    const bool negative = hn::GetLane(scaled[0]) < 0.0f;
    alignas(64) float samples[root_sample_count + 1];
    hn::StoreU(scaled[0], one, samples);
    unsigned crossed = 0;
    for (std::size_t first = 0; first < root_sample_count; first += hn::Lanes(d)) {
        auto sum = hn::Mul(spread(scaled[0]), hn::Load(d, root_sample_factors<Order>.of[0] + first));
        for (int r = 1; r <= Order; ++r)
            sum = hn::MulAdd(spread(scaled[r]), hn::Load(d, root_sample_factors<Order>.of[r] + first), sum);
        hn::StoreU(sum, d, samples + 1 + first);
        crossed |= to_lane_mask(d, negative ? hn::Ge(sum, hn::Zero(d)) : hn::Lt(sum, hn::Zero(d)), first);
    }
    // Two samples on each side of the root, if there are.
    const int first =
        crossed == 0 ? root_sample_count - 3 : std::clamp(std::countr_zero(crossed) - 1, 0, root_sample_count - 3);
    const auto sample = [&](int j) HWY_ATTR { return hn::Set(one, samples[first + j]); };
    const One step = zero_of_cubic<One>({sample(0), sample(1), sample(2), sample(3)});
    const One s = (number<One>(first) + step) * number<One>(1.0 / root_sample_count);
    const auto [root, slope] = improve_root<Order>(s, scaled);
    return {hn::GetLane(root), hn::GetLane(slope)};
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
