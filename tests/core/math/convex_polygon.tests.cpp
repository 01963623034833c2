#include "catch.h"

#include "isospline/math/convex_polygon.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <random>

using namespace isospline;

namespace {

const ConvexPolygon square{{0, 0, 1}, {2, 0, 1}, {2, 2, 1}, {0, 2, 1}};

} // namespace

TEST_CASE("a polygon is cut by half-spaces", "[math]")
{
    CHECK(cut(square, {1, 0, 0}, -1.0).size() == 4); // all is inside
    CHECK(cut(square, {1, 0, 0}, 3.0).empty());
    const ConvexPolygon half = cut(square, {1, 0, 0}, 1.5);
    REQUIRE(half.size() == 4);
    for (const glm::dvec3& corner : half)
        CHECK((corner.x == 1.5 || corner.x == 2.0));
    const glm::dvec3 diagonal(-1, -1, 0);
    CHECK(cut(square, diagonal, -3.0).size() == 5); // a corner is cut off
}

TEST_CASE("the nearest point of a polygon is nearest among its points", "[math]")
{
    std::mt19937 random(1);
    std::uniform_real_distribution<double> coordinate(-2.0, 4.0);
    for (int i = 0; i < 1000; ++i) {
        const glm::dvec3 point(coordinate(random), coordinate(random), coordinate(random));
        const glm::dvec3 nearest = closest_point_of_polygon(point, square);
        const glm::dvec3 expected(glm::clamp(point.x, 0.0, 2.0), glm::clamp(point.y, 0.0, 2.0), 1.0);
        CHECK(glm::distance(nearest, expected) < 1e-12);
    }
}
