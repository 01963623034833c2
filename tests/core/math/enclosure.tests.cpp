#include "catch.h"

#include "isospline/math/enclosure.h"

#include <cmath>
#include <random>

using namespace isospline;

namespace {

/// Whether an enclosure contains a number that is known to within 2^-60 of its size.
bool contains(const Enclosure& enclosure, long double number)
{
    const long double error = std::abs(number) * 0x1p-60L;
    return enclosure.lower() <= number + error && enclosure.upper() >= number - error;
}

} // namespace

TEST_CASE("enclosures contain the results for all their numbers", "[math]")
{
    std::mt19937 random(1);
    std::uniform_real_distribution<double> number(-3.0, 3.0), part(-1.0, 1.0);
    std::uniform_int_distribution<int> size(-60, 2);
    for (int i = 0; i < 100000; ++i) {
        const Enclosure a(number(random), i % 3 == 0 ? 0.0 : std::ldexp(1.0, size(random)));
        const Enclosure b(number(random), i % 2 == 0 ? 0.0 : std::ldexp(1.0, size(random)));
        const long double x = a.value + static_cast<long double>(a.radius) * part(random);
        const long double y = b.value + static_cast<long double>(b.radius) * part(random);
        const bool all = contains(a + b, x + y) && contains(a - b, x - y) && contains(a * b, x * y) &&
                         contains(inverse(a), 1.0L / x);
        REQUIRE(all);
    }
}

TEST_CASE("enclosures of exact numbers are exact where double precision is", "[math]")
{
    const auto is_exactly = [](const Enclosure& enclosure, double number) {
        return enclosure.value == number && enclosure.radius == 0.0 && enclosure.lower() == number &&
               enclosure.upper() == number;
    };
    REQUIRE(is_exactly(Enclosure(0.75) + 3.0, 3.75));
    REQUIRE(is_exactly(Enclosure(0.75) * -3.0, -2.25));
    REQUIRE(is_exactly(inverse(Enclosure(-0.25)), -4.0));
    REQUIRE(is_exactly(Enclosure(0.0, 1.0) * 0.0, 0.0));
    REQUIRE_FALSE(is_exactly(inverse(Enclosure(3.0)), 1.0 / 3.0));
    REQUIRE(std::isinf(inverse(Enclosure(1.0, 1.0)).radius));
    REQUIRE(Enclosure(1.0, 1.0).contains_zero());
    REQUIRE_FALSE(Enclosure(1.0, 0.5).contains_zero());
}

TEST_CASE("the error of a rounded sum is not lost", "[math]")
{
    const Enclosure sum = Enclosure(1.0) + 0x1p-80;
    REQUIRE(sum.value == 1.0);
    REQUIRE(sum.lower() < 1.0);
    REQUIRE(sum.upper() > 1.0);
    const Enclosure tiny = Enclosure(0x1p-600) * 0x1p-600;
    REQUIRE(tiny.value == 0.0);
    REQUIRE(tiny.upper() > 0.0);
}

TEST_CASE("the error of a rounded product is exact", "[math]")
{
    std::mt19937 random(2);
    std::uniform_real_distribution<double> number(-3.0, 3.0);
    std::uniform_int_distribution<int> size(-300, 300);
    for (int i = 0; i < 100000; ++i) {
        const double a = std::ldexp(number(random), size(random)), b = std::ldexp(number(random), size(random));
        const double product = a * b;
        REQUIRE(detail::error_of_product(a, b, product) == std::fma(a, b, -product));
    }
}
