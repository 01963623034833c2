#include "catch.h"

#include "isospline/polygonize/face_crossing.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

using namespace isospline;

TEST_CASE("faces cross where they meet elsewhere than at common vertices and edges", "[polygonize]")
{
    const std::vector<glm::dvec3> vertices{
        {0.0, 0.0, 0.0},  {1.0, 0.0, 0.0},  {0.0, 1.0, 0.0}, // a triangle in a plane
        {0.25, 0.25, -1}, {0.25, 0.25, 1},  {2.0, 2.0, 0.0}, // across it
        {1.0, 1.0, 0.0},  {0.25, 0.25, 0},  {0.0, 0.0, 1.0}, // in its plane, in it, above
        {-1.0, 0.0, 0.0}, {0.0, -1.0, 0.0}, {0.0, 0.0, std::ldexp(1.0, -60)},
    };
    const glm::uvec3 face(0, 1, 2);
    const auto crosses = [&](const glm::uvec3& other) {
        REQUIRE(faces_cross(vertices, face, other) == faces_cross(vertices, other, face));
        return faces_cross(vertices, face, other);
    };
    REQUIRE(crosses({3, 4, 5}));   // through it
    REQUIRE(!crosses({4, 5, 8}));  // above
    REQUIRE(crosses({7, 5, 8}));   // touches it with a corner
    REQUIRE(!crosses({1, 2, 6}));  // a neighbour in its plane
    REQUIRE(crosses({1, 2, 7}));   // folded over
    REQUIRE(!crosses({1, 2, 8}));  // a neighbour
    REQUIRE(!crosses({0, 9, 10})); // shares a corner
    REQUIRE(crosses({0, 7, 8}));   // shares a corner, and an edge is in the plane
    REQUIRE(!crosses({11, 8, 9})); // above a corner by less than rounding
    REQUIRE(find_crossings(vertices, {face, {3, 4, 5}, {0, 9, 10}, {1, 2, 8}}).size() == 2);
    REQUIRE(find_crossings(vertices, {}).empty());
}

TEST_CASE("crossings of some faces are those of all faces in which they take part", "[polygonize]")
{
    std::mt19937 random(3);
    std::uniform_real_distribution<double> coordinate(0.0, 1.0);
    std::vector<glm::dvec3> vertices;
    std::vector<glm::uvec3> faces;
    std::vector<std::uint8_t> is_examined;
    for (std::uint32_t face = 0; face < 60; ++face) {
        for (int corner = 0; corner < 3; ++corner)
            vertices.emplace_back(coordinate(random), coordinate(random), coordinate(random));
        faces.emplace_back(3 * face, 3 * face + 1, 3 * face + 2);
        is_examined.push_back(face % 4 == 1 ? 1 : 0);
    }
    std::vector<std::array<std::uint32_t, 2>> expected;
    for (std::uint32_t a = 0; a < faces.size(); ++a)
        for (std::uint32_t b = a + 1; b < faces.size(); ++b)
            if ((is_examined[a] != 0 || is_examined[b] != 0) && faces_cross(vertices, faces[a], faces[b]))
                expected.push_back({a, b});
    REQUIRE(expected.size() > 10);
    REQUIRE(find_crossings(vertices, faces, is_examined) == expected);
}
