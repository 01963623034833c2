#include "catch.h"

#include "isospline/math/power-inl.h"

#include <random>

using namespace isospline;

TEST_CASE("powers are those of the standard library", "[math]")
{
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0.0, 2.0);
    for (int i = 0; i < 20000; ++i) {
        const double base = uniform(random);
        for (const double exponent : {0.0, 1.0, 2.0, 3.0, 30.0, 127.0, 500.0, 1024.0, 1025.0, 0.5, 2.5, 30.25}) {
            const double expected = std::pow(base, exponent);
            if (expected < 1e300 && expected > 1e-300)
                REQUIRE(scalar::power(base, exponent) == Approx(expected).epsilon((1.0 + exponent) * 0x1p-52));
        }
    }
    REQUIRE(scalar::power(0.0, 0.0) == 1.0);
    REQUIRE(scalar::power(0.0, 30.0) == 0.0);
    REQUIRE(scalar::power(0.5, 1e6) == 0.0);
}
