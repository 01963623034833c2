#include "catch.h"

#include "isospline/math/frame.h"
#include "isospline/math/random.h"

#include <glm/geometric.hpp>

#include <array>
#include <random>
#include <vector>

using namespace isospline;

TEST_CASE("pcg4d is the published formula", "[math]")
{
    // Computed with Python's integers.
    using Words = std::array<std::uint32_t, 4>;
    REQUIRE(pcg4d({0, 0, 0, 0}) == Words{0xf02f829u, 0x2d568769u, 0x32b0c43bu, 0xd32548eau});
    REQUIRE(pcg4d({1, 2, 3, 4}) == Words{0x3622cd16u, 0xf11471d8u, 0xe1109b3fu, 0x2b94c2fu});
}

TEST_CASE("random numbers are even, and those of pixels, samples, seeds and dimensions independent", "[math]")
{
    // Chi-squared of a 16 x 16 grid over pairs of numbers that differ in one respect each.
    const auto chi_squared = [](const auto& pair) {
        constexpr int count = 100000, cells = 256;
        std::vector<int> found(cells, 0);
        for (int i = 0; i < count; ++i) {
            const glm::dvec2 u = pair(i);
            REQUIRE((u.x >= 0.0 && u.x < 1.0 && u.y >= 0.0 && u.y < 1.0));
            ++found[static_cast<std::size_t>(u.x * 16) * 16 + static_cast<std::size_t>(u.y * 16)];
        }
        double sum = 0.0;
        for (const int n : found)
            sum += (n - count / 256.0) * (n - count / 256.0) / (count / 256.0);
        return sum;
    };
    const auto first = [](glm::ivec2 pixel, std::uint32_t sample, std::uint32_t seed) {
        return RandomSequence(pixel, sample, seed).next();
    };
    // 255 degrees of freedom: 350 is exceeded by chance once in 15000 times.
    REQUIRE(chi_squared([&](int i) { return RandomSequence({i, 5}, 0).next2(); }) < 350.0);
    REQUIRE(chi_squared([&](int i) { return glm::dvec2(first({i, 5}, 0, 0), first({i + 1, 5}, 0, 0)); }) < 350.0);
    REQUIRE(chi_squared([&](int i) { return glm::dvec2(first({i, 5}, 0, 0), first({i, 6}, 0, 0)); }) < 350.0);
    REQUIRE(chi_squared([&](int i) { return glm::dvec2(first({3, 5}, i, 0), first({3, 5}, i + 1, 0)); }) < 350.0);
    REQUIRE(chi_squared([&](int i) { return glm::dvec2(first({i, 5}, 0, 7), first({i, 5}, 0, 8)); }) < 350.0);
    RandomSequence one({3, 4}, 5);
    REQUIRE(chi_squared([&](int) { return one.next2(); }) < 350.0);
    REQUIRE(first({3, 4}, 5, 6) == first({3, 4}, 5, 6));
}

TEST_CASE("frames are right-handed and orthonormal, cosine directions have the mean cosine 2/3", "[math]")
{
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    for (int trial = 0; trial < 1000; ++trial) {
        glm::dvec3 z = glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
        if (trial < 4)
            z = {0.0, trial % 2 == 0 ? 0.0 : -0.0, trial < 2 ? 1.0 : -1.0};
        const Frame frame(z);
        REQUIRE(glm::distance(glm::cross(frame.x, frame.y), z) < 1e-14);
        REQUIRE(glm::length(frame.x) == Approx(1.0).epsilon(1e-14));
        REQUIRE(glm::length(frame.y) == Approx(1.0).epsilon(1e-14));
        const glm::dvec3 v(normal(random), normal(random), normal(random));
        REQUIRE(glm::distance(frame.to_local(frame.to_world(v)), v) < 1e-13);
    }
    double sum = 0.0;
    for (int i = 0; i < 100000; ++i) {
        const glm::dvec3 w = cosine_direction(RandomSequence({i, 0}, 0).next2());
        REQUIRE(glm::length(w) == Approx(1.0).epsilon(1e-12));
        sum += w.z;
    }
    REQUIRE(sum / 100000 == Approx(2.0 / 3.0).margin(3e-3));
}
