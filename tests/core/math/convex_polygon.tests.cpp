#include "catch.h"

#include "isospline/math/convex_polygon.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cmath>
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

TEST_CASE("the width of a polygon is known up to a factor of two", "[math]")
{
    CHECK(width_of({}) == 0.0);
    CHECK(width_of({{1, 2, 3}, {2, 3, 4}}) == 0.0);
    CHECK(width_of({{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}) == 0.0);
    std::mt19937 random(2);
    std::uniform_real_distribution<double> angle(0.0, 6.28), exponent(-9.0, 0.0);
    for (int i = 0; i < 1000; ++i) {
        const double width = std::pow(10.0, exponent(random)), turn = angle(random);
        const glm::dvec3 along(std::cos(turn), std::sin(turn), 0.5), across(-std::sin(turn), std::cos(turn), 0.0);
        const glm::dvec3 end = 1.5 * along, side = width * across;
        for (const ConvexPolygon& polygon :
             {ConvexPolygon{{0, 0, 0}, end, end + side, side}, ConvexPolygon{{0, 0, 0}, end, 0.3 * end + side}}) {
            CHECK(width_of(polygon) <= width * (1.0 + 1e-6));
            CHECK(width_of(polygon) >= 0.5 * width * (1.0 - 1e-6));
        }
    }
}
