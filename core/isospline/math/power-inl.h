// Powers, as in illumination models. Included once for each SIMD target.
#include "isospline/math/number-inl.h"

#include <cmath>
#include <cstdint>
#include <type_traits>

#if defined(ISOSPLINE_MATH_POWER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_MATH_POWER_INL_H
#undef ISOSPLINE_MATH_POWER_INL_H
#else
#define ISOSPLINE_MATH_POWER_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// base^exponent for a base of at least 0. Integer exponents up to 1024, which most highlights have, are computed as
/// products of squares: several times as fast, with an error of about `exponent` roundings.
template <class N>
HWY_INLINE N power(N base, double exponent)
{
    constexpr double most = 1024.0;
    if (exponent >= 0.0 && exponent <= most && exponent == std::trunc(exponent)) {
        N product = number<N>(1.0);
        for (auto rest = static_cast<std::uint32_t>(exponent); rest != 0; rest >>= 1) {
            if ((rest & 1u) != 0)
                product = product * base;
            base = base * base;
        }
        return product;
    }
    if constexpr (std::is_arithmetic_v<N>) {
        return std::pow(base, exponent);
    } else {
        const hn::DFromV<N> d;
        alignas(64) hn::TFromD<hn::DFromV<N>> lanes[hn::MaxLanes(d)];
        hn::Store(base, d, lanes);
        for (auto& lane : lanes)
            lane = std::pow(lane, exponent);
        return hn::Load(d, lanes);
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
