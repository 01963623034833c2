// Exact arithmetic, against integers of 128 bits and against identities that only exact numbers fulfil.
#include "catch.h"

#include "isospline/math/expansion.h"

#include <cmath>
#include <cstdint>
#include <random>

using namespace isospline;

namespace {

__extension__ using Integer = __int128;

int sign_of(Integer value)
{
    return (value > 0) - (value < 0);
}

} // namespace

TEST_CASE("determinants of integers have the sign computed with 128 bits", "[math]")
{
    std::mt19937_64 random(1);
    std::uniform_int_distribution<std::int64_t> large(-(1ll << 40), 1ll << 40), small(-3, 3);
    int zeros = 0;
    for (int i = 0; i < 20000; ++i) {
        // The second row is close to a multiple of the first, or is one.
        const std::int64_t a = large(random), b = large(random), factor = small(random);
        const std::int64_t c = factor * a + small(random) / 3, d = factor * b + small(random) / 3;
        const auto exact = [](std::int64_t value) { return Expansion(static_cast<double>(value)); };
        const Expansion determinant = exact(a) * exact(d) - exact(b) * exact(c);
        const Integer expected = Integer(a) * d - Integer(b) * c;
        REQUIRE(determinant.sign() == sign_of(expected));
        zeros += expected == 0;
    }
    CHECK(zeros > 1000);
}

TEST_CASE("numbers of very different sizes keep all of their digits", "[math]")
{
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> mantissa(-1.0, 1.0);
    std::uniform_int_distribution<int> exponent(-80, 80);
    for (int i = 0; i < 2000; ++i) {
        const auto any = [&] { return std::ldexp(mantissa(random), exponent(random)); };
        const Expansion a = Expansion::difference(any(), any()), b = Expansion::difference(any(), any());
        const Expansion c = Expansion::difference(any(), any());
        CHECK(((a + b) * c - a * c - b * c).sign() == 0);
        CHECK(((a + b) * (a - b) - (a * a - b * b)).sign() == 0);
        CHECK((a * b * c * a - c * a * a * b).sign() == 0);
        const Expansion tiny(std::ldexp(1.0, -700));
        CHECK((a * b * c + tiny - c * b * a).sign() == 1);
        CHECK((a * b * c - tiny - c * b * a).sign() == -1);
    }
    CHECK(Expansion().sign() == 0);
    CHECK(Expansion(0.0).sign() == 0);
    CHECK(Expansion::difference(0.1, 0.1).sign() == 0);
}
