// The number types of formulas: double, and Highway's vectors of float or double whose number of lanes is known at
// compile time. Included once for each SIMD target.
//
// A formula is a template on its number type. So a single ray, a ray in a packet and the reference take the same
// operations in the same order, and lanes of the same type agree bit for bit. Sums, products and quotients are written
// as operators; this file has the other operations.
//
// Code that is compiled once, and not for each target, uses these formulas as `scalar::formula(...)`.
#include <hwy/highway.h>

#include <cmath>
#include <cstddef>
#include <type_traits>
#include <utility>

#if defined(ISOSPLINE_MATH_NUMBER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_MATH_NUMBER_INL_H
#undef ISOSPLINE_MATH_NUMBER_INL_H
#else
#define ISOSPLINE_MATH_NUMBER_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// A constant, in all lanes.
template <class N>
HWY_INLINE constexpr N number(double value)
{
    if constexpr (std::is_arithmetic_v<N>) {
        return static_cast<N>(value);
    } else {
        const hn::DFromV<N> d;
        return hn::Set(d, static_cast<hn::TFromD<hn::DFromV<N>>>(value));
    }
}

/// A coefficient in all lanes, if it is not one for each lane.
template <class N, class Coefficient>
HWY_INLINE constexpr N in_lanes(Coefficient coefficient)
{
    if constexpr (std::is_arithmetic_v<Coefficient>)
        return number<N>(coefficient);
    else
        return coefficient;
}

template <class N>
HWY_INLINE constexpr N negated(N a)
{
    if constexpr (std::is_arithmetic_v<N>)
        return -a;
    else
        return hn::Neg(a);
}

/// a b + c. Vectors fuse it if the machine can; double never does, so that the result is the same on all machines.
template <class N>
HWY_INLINE constexpr N mul_add(N a, N b, N c)
{
    static_assert(!std::is_same_v<N, float>,
                  "a single float goes into a vector of one lane, to be fused as others are");
    if constexpr (std::is_arithmetic_v<N>)
        return a * b + c;
    else
        return hn::MulAdd(a, b, c);
}

/// a b - c, likewise.
template <class N>
HWY_INLINE constexpr N mul_sub(N a, N b, N c)
{
    static_assert(!std::is_same_v<N, float>);
    if constexpr (std::is_arithmetic_v<N>)
        return a * b - c;
    else
        return hn::MulSub(a, b, c);
}

template <class N>
HWY_INLINE N square_root(N a)
{
    if constexpr (std::is_arithmetic_v<N>)
        return std::sqrt(a);
    else
        return hn::Sqrt(a);
}

/// a b + c with one rounding, whether the machine has an instruction for it or not.
template <class N>
HWY_INLINE N fused_mul_add(N a, N b, N c)
{
    if constexpr (std::is_arithmetic_v<N>) {
        return std::fma(a, b, c);
    } else {
#if HWY_NATIVE_FMA
        return hn::MulAdd(a, b, c);
#else
        const hn::DFromV<N> d;
        alignas(64) hn::TFromD<hn::DFromV<N>> factors[2][hn::MaxLanes(d)], sums[hn::MaxLanes(d)];
        hn::Store(a, d, factors[0]);
        hn::Store(b, d, factors[1]);
        hn::Store(c, d, sums);
        for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane)
            sums[lane] = std::fma(factors[0][lane], factors[1][lane], sums[lane]);
        return hn::Load(d, sums);
#endif
    }
}

template <class N>
HWY_INLINE N absolute(N a)
{
    if constexpr (std::is_arithmetic_v<N>)
        return std::abs(a);
    else
        return hn::Abs(a);
}

template <class N>
HWY_INLINE N rounded_to_floor(N a)
{
    if constexpr (std::is_arithmetic_v<N>)
        return std::floor(a);
    else
        return hn::Floor(a);
}

/// The magnitude of a with the sign of b.
template <class N>
HWY_INLINE N with_sign_of(N a, N b)
{
    if constexpr (std::is_arithmetic_v<N>)
        return std::copysign(a, b);
    else
        return hn::CopySign(a, b);
}

/// The smaller number; b if either is NaN.
template <class N>
HWY_INLINE constexpr N smaller(N a, N b)
{
    if constexpr (std::is_arithmetic_v<N>)
        return a < b ? a : b;
    else
        return hn::Min(a, b);
}

/// The larger number; b if either is NaN.
template <class N>
HWY_INLINE constexpr N larger(N a, N b)
{
    if constexpr (std::is_arithmetic_v<N>)
        return a > b ? a : b;
    else
        return hn::Max(a, b);
}

/// a < b: a bool, or a mask of lanes.
template <class N>
HWY_INLINE constexpr auto less(N a, N b)
{
    if constexpr (std::is_arithmetic_v<N>)
        return a < b;
    else
        return hn::Lt(a, b);
}

template <class N>
HWY_INLINE constexpr auto less_equal(N a, N b)
{
    if constexpr (std::is_arithmetic_v<N>)
        return a <= b;
    else
        return hn::Le(a, b);
}

template <class N>
HWY_INLINE constexpr auto equal(N a, N b)
{
    if constexpr (std::is_arithmetic_v<N>)
        return a == b;
    else
        return hn::Eq(a, b);
}

/// The type that less() returns.
template <class N>
using MaskOf = decltype(less(std::declval<N>(), std::declval<N>()));

template <class M>
HWY_INLINE constexpr M both(M a, M b)
{
    if constexpr (std::is_same_v<M, bool>)
        return static_cast<bool>(a & b);
    else
        return hn::And(a, b);
}

template <class M>
HWY_INLINE constexpr M either(M a, M b)
{
    if constexpr (std::is_same_v<M, bool>)
        return static_cast<bool>(a | b);
    else
        return hn::Or(a, b);
}

/// a and not b.
template <class M>
HWY_INLINE constexpr M without(M a, M b)
{
    if constexpr (std::is_same_v<M, bool>)
        return static_cast<bool>(a & !b);
    else
        return hn::AndNot(b, a);
}

/// Exactly one of the two.
template <class M>
HWY_INLINE constexpr M differ(M a, M b)
{
    if constexpr (std::is_same_v<M, bool>)
        return a != b;
    else
        return hn::Xor(a, b);
}

/// a where the mask is set, b elsewhere.
template <class M, class N>
HWY_INLINE constexpr N select(M mask, N a, N b)
{
    if constexpr (std::is_same_v<M, bool>)
        return mask ? a : b;
    else
        return hn::IfThenElse(mask, a, b);
}

} // namespace HWY_NAMESPACE

#if HWY_ONCE
namespace scalar = HWY_NAMESPACE;
#endif

} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
