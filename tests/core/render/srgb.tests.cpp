#include "catch.h"

#include "isospline/render/srgb.h"

#include <cmath>
#include <limits>
#include <random>

using namespace isospline;

namespace {

/// IEC 61966-2-1, rounded.
int reference(double linear)
{
    const double clipped = std::min(std::max(linear, 0.0), 1.0);
    const double encoded = clipped <= 0.0031308 ? 12.92 * clipped : 1.055 * std::pow(clipped, 1.0 / 2.4) - 0.055;
    return static_cast<int>(std::lrint(255.0 * encoded));
}

} // namespace

TEST_CASE("colours are rounded to the code of the standard's curve", "[render]")
{
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(-0.1f, 1.2f);
    std::size_t off = 0;
    const auto check = [&](float linear) {
        const glm::u8vec4 found = to_srgb8({linear, 0.0f, 1.0f, 1.0f});
        REQUIRE(found.g == 0);
        REQUIRE(found.b == 255);
        REQUIRE(found.a == 255);
        const int difference = found.r - reference(static_cast<double>(linear));
        REQUIRE(std::abs(difference) <= 1); // the curve and its inverse, as the standard has them, differ by 1e-8
        off += difference != 0;
    };
    for (int i = 0; i < 200000; ++i)
        check(uniform(random));
    for (int i = 0; i < 200000; ++i)
        check(std::pow(10.0f, -5.0f * std::abs(uniform(random))));
    REQUIRE(off < 5);
}

TEST_CASE("colours lose the factor of alpha before they are encoded", "[render]")
{
    for (int i = 1; i <= 1000; ++i) {
        const float alpha = static_cast<float>(i) / 1000.0f, part = 0.37f * alpha;
        const glm::u8vec4 found = to_srgb8({part, 2.0f, -1.0f, alpha});
        REQUIRE(found.r == reference(static_cast<double>(part) / static_cast<double>(alpha)));
        REQUIRE(found.g == 255);
        REQUIRE(found.b == 0);
        REQUIRE(found.a == std::lrint(255.0 * static_cast<double>(alpha)));
    }
    const float nan = std::numeric_limits<float>::quiet_NaN();
    REQUIRE(to_srgb8({0.5f, 0.5f, 0.5f, 0.0f}) == glm::u8vec4(0));
    REQUIRE(to_srgb8({nan, 1.0f, 1.0f, 1.0f}) == glm::u8vec4(0, 255, 255, 255));
    REQUIRE(to_srgb8({1.0f, 1.0f, 1.0f, nan}) == glm::u8vec4(0));
}
