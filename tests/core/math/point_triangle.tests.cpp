#include "catch.h"

#include "isospline/math/point_triangle.h"

#include <algorithm>
#include <random>

using namespace isospline;

TEST_CASE("no point of a triangle is nearer, even if its corners are collinear", "[math]")
{
    std::mt19937 random(3);
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    const auto any = [&] { return glm::dvec3(number(random), number(random), number(random)); };
    for (int trial = 0; trial < 300; ++trial) {
        const glm::dvec3 a = any(), b = any(), point = 2.0 * any();
        const glm::dvec3 c = trial % 3 == 0 ? a + number(random) * (b - a) : any();
        const glm::dvec2 uv = closest_on_triangle(point, a, b, c);
        CHECK((uv.x >= 0.0 && uv.y >= 0.0 && uv.x + uv.y <= 1.0 + 1e-15));
        const double distance = glm::length(a + uv.x * (b - a) + uv.y * (c - a) - point);
        double least = 1e300;
        for (int i = 0; i <= 40; ++i)
            for (int j = 0; i + j <= 40; ++j)
                least = std::min(least, glm::length(a + i / 40.0 * (b - a) + j / 40.0 * (c - a) - point));
        CHECK(distance <= least + 1e-12);
        CHECK(least - distance < 0.1);
        CHECK(glm::length(closest_point_of_triangle(point, a, b, c) - point) == Approx(distance).margin(1e-14));
    }
}
