// Real numbers that are known to within proven bounds.
#pragma once

#include <cmath>

namespace isospline {

/// The numbers within `radius` of `value`. An operation encloses every result for numbers of its operands. Its radius
/// has the exact rounding error of its value, so exact operations on exact numbers stay exact. Nothing may overflow.
struct Enclosure {
    Enclosure() = default;
    Enclosure(double exact) : value(exact) {}
    Enclosure(double middle, double bound) : value(middle), radius(bound) {}

    /// Bounds on the numbers. The last term is above both roundings.
    double lower() const { return radius == 0.0 ? value : value - radius - 0x1p-51 * (std::abs(value) + radius); }
    double upper() const { return radius == 0.0 ? value : value + radius + 0x1p-51 * (std::abs(value) + radius); }
    bool contains_zero() const { return !(std::abs(value) > radius); }

    double value = 0.0, radius = 0.0;
};

namespace detail {

/// More than a sum of a few non-negative numbers that was computed with rounding to nearest: 2^-48 is above 2^5
/// roundings, and the smallest normal number is above what underflow takes from them.
inline double above(double bound)
{
    return bound * (1.0 + 0x1p-48) + 0x1p-1022;
}

/// The rounding error of the product of two numbers below 2^995, without a fused multiply-add, which not every machine
/// has (Veltkamp's splitting and Dekker's product). It is exact unless it underflows.
inline double error_of_product(double a, double b, double product)
{
    constexpr double splitter = 0x1p27 + 1.0;
    const double scaled_a = splitter * a, high_a = scaled_a - (scaled_a - a), low_a = a - high_a;
    const double scaled_b = splitter * b, high_b = scaled_b - (scaled_b - b), low_b = b - high_b;
    return ((high_a * high_b - product) + high_a * low_b + low_a * high_b) + low_a * low_b;
}

} // namespace detail

inline Enclosure operator-(const Enclosure& a)
{
    return {-a.value, a.radius};
}

inline Enclosure operator+(const Enclosure& a, const Enclosure& b)
{
    // The rounding error of a sum is a number itself (Knuth's TwoSum).
    const double sum = a.value + b.value, of_b = sum - a.value;
    const double error = (a.value - (sum - of_b)) + (b.value - of_b);
    if (error == 0.0 && a.radius == 0.0 && b.radius == 0.0)
        return sum;
    return {sum, detail::above(std::abs(error) + a.radius + b.radius)};
}

inline Enclosure operator-(const Enclosure& a, const Enclosure& b)
{
    return a + -b;
}

inline Enclosure operator*(const Enclosure& a, const Enclosure& b)
{
    if ((a.value == 0.0 && a.radius == 0.0) || (b.value == 0.0 && b.radius == 0.0))
        return 0.0;
    // The rounding error of a product is a number too, unless it underflows: then it is below 2^-1022.
    const double product = a.value * b.value, error = detail::error_of_product(a.value, b.value, product);
    const bool is_exact = error == 0.0 && std::abs(product) > 0x1p-900;
    if (is_exact && a.radius == 0.0 && b.radius == 0.0)
        return product;
    return {product, detail::above(std::abs(error) + std::abs(a.value) * b.radius + std::abs(b.value) * a.radius +
                                   a.radius * b.radius + 0x1p-1022)};
}

/// 1 / a; infinite if a contains zero.
inline Enclosure inverse(const Enclosure& a)
{
    if (a.contains_zero())
        return {0.0, HUGE_VAL};
    // |1 / x - inverse| = |1 - inverse x| / |x|.
    const double inverse = 1.0 / a.value, product = inverse * a.value;
    const double rest = (1.0 - product) - detail::error_of_product(inverse, a.value, product);
    if (rest == 0.0 && a.radius == 0.0)
        return inverse;
    const double least = (std::abs(a.value) - a.radius) * (1.0 - 0x1p-50);
    if (!(least > 0.0))
        return {0.0, HUGE_VAL};
    return {inverse, detail::above(detail::above(std::abs(rest) + std::abs(inverse) * a.radius) / least)};
}

} // namespace isospline
