// Powers, as illumination models have them.
#pragma once

#include <cmath>
#include <cstdint>

namespace isospline {

/// base^exponent for a base of at least 0. Whole exponents up to 1024, as highlights mostly have, are products of
/// squares: to some exponent roundings the same, and several times as fast.
inline double power(double base, double exponent)
{
    constexpr double most = 1024.0;
    if (!(exponent >= 0.0 && exponent <= most) || exponent != std::trunc(exponent))
        return std::pow(base, exponent);
    double product = 1.0;
    for (auto rest = static_cast<std::uint32_t>(exponent); rest != 0; rest >>= 1) {
        if ((rest & 1u) != 0)
            product *= base;
        base *= base;
    }
    return product;
}

} // namespace isospline
