// Rays and triangles, against the definition of the rule: the ray is moved by (e, e^2, e^3), in integers of 128 bits.
#include "catch.h"

#include "isospline/trace/triangle.h"
#include "isospline/trace/triangle_packet.h"

#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <random>

using namespace isospline;

namespace {

__extension__ using Integer = __int128;
using Vector = std::array<Integer, 3>;

// e = 2^-12 is small enough for coordinates up to 4: signs that are not zero are those of numbers of at least 1, and
// what e multiplies is below 2^6.
constexpr int bits = 12;

Vector moved(const glm::dvec3& v, bool is_origin)
{
    Vector result;
    for (int axis = 0; axis < 3; ++axis) {
        result[static_cast<std::size_t>(axis)] = Integer(static_cast<std::int64_t>(v[axis])) << 3 * bits;
        if (is_origin)
            result[static_cast<std::size_t>(axis)] += Integer(1) << (2 - axis) * bits;
    }
    return result;
}

Integer determinant(const glm::dvec3& direction, const Vector& a, const Vector& b)
{
    const auto d = [&](int axis) { return Integer(static_cast<std::int64_t>(direction[axis])); };
    return d(0) * (a[1] * b[2] - a[2] * b[1]) + d(1) * (a[2] * b[0] - a[0] * b[2]) + d(2) * (a[0] * b[1] - a[1] * b[0]);
}

Passage expected_passage(const glm::dvec3& origin, const glm::dvec3& direction, const Triangle& triangle)
{
    const Vector from = moved(origin, true);
    std::array<Vector, 3> corners{moved(triangle.a, false), moved(triangle.b, false), moved(triangle.c, false)};
    for (Vector& corner : corners)
        for (std::size_t axis = 0; axis < 3; ++axis)
            corner[axis] -= from[axis];
    int above = 0, below = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Integer side = determinant(direction, corners[i], corners[(i + 1) % 3]);
        above += side > 0;
        below += side < 0;
    }
    return above == 3 ? Passage::along_normal : (below == 3 ? Passage::against_normal : Passage::none);
}

glm::dvec3 random_point(std::mt19937_64& random, int largest)
{
    std::uniform_int_distribution<int> coordinate(-largest, largest);
    return {coordinate(random), coordinate(random), coordinate(random)};
}

} // namespace

TEST_CASE("lines through integer triangles pass them as a line that is moved does", "[trace]")
{
    std::mt19937_64 random(3);
    int passed = 0, degenerate = 0;
    for (int i = 0; i < 300000; ++i) {
        const int largest = 1 + i % 4;
        const Triangle triangle{random_point(random, largest), random_point(random, largest),
                                random_point(random, largest)};
        const glm::dvec3 origin = random_point(random, largest);
        const glm::dvec3 direction = random_point(random, 2);
        if (direction == glm::dvec3(0.0))
            continue;
        const Passage expected = expected_passage(origin, direction, triangle);
        REQUIRE(passage(origin, direction, triangle) == expected);
        REQUIRE(exact_passage(origin, direction, triangle) == expected);
        passed += expected != Passage::none;
        degenerate += glm::cross(triangle.b - triangle.a, triangle.c - triangle.a) == glm::dvec3(0.0);
    }
    CHECK(passed > 10000);
    CHECK(degenerate > 1000);
}

TEST_CASE("a packet passes triangles as its rays do", "[trace]")
{
    std::mt19937_64 random(4);
    for (int i = 0; i < 20000; ++i) {
        const Triangle triangle{random_point(random, 2), random_point(random, 2), random_point(random, 2)};
        TriangleRayPacket rays;
        std::array<TriangleRay, TriangleRayPacket::capacity> singles;
        for (int lane = 0; lane < TriangleRayPacket::capacity; ++lane) {
            TriangleRay& single = singles[static_cast<std::size_t>(lane)];
            single = TriangleRay({random_point(random, 2), random_point(random, 2) + glm::dvec3(0.1, 0.0, 0.0)});
            rays.set(lane, single);
        }
        const LaneMask lanes = static_cast<LaneMask>(random()) & 0xffffu;
        const LanePassages found = passages(rays, triangle, lanes);
        for (int lane = 0; lane < TriangleRayPacket::capacity; ++lane) {
            const TriangleRay& single = singles[static_cast<std::size_t>(lane)];
            const bool wanted = (lanes >> lane & 1u) != 0;
            const Passage expected = wanted ? passage(single.origin, single.direction, triangle) : Passage::none;
            CHECK((found.along_normal >> lane & 1u) == (expected == Passage::along_normal));
            CHECK((found.against_normal >> lane & 1u) == (expected == Passage::against_normal));
        }
    }
}

TEST_CASE("t is that of the plane, in units of the ray as given, within its error", "[trace]")
{
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto point = [&] { return glm::dvec3(uniform(random), uniform(random), uniform(random)); };
    int tested = 0;
    for (int i = 0; i < 100000; ++i) {
        const Triangle triangle{point(), point(), point()};
        const double distance = std::pow(10.0, 3.0 * uniform(random) + 1.0);
        const glm::dvec3 target = (triangle.a + triangle.b + triangle.c) / 3.0;
        const glm::dvec3 origin = target + distance * point();
        const glm::dvec3 direction = (target - origin) * std::pow(10.0, 100.0 * uniform(random));
        const TriangleRay ray({origin, direction});
        const Passage found = passage(ray.origin, ray.direction, triangle);
        if (found == Passage::none)
            continue;
        ++tested;
        const TriangleHit hit = triangle_hit(ray, triangle, found);
        using Long = long double;
        const auto sub = [](const glm::dvec3& a, const glm::dvec3& b) {
            return glm::vec<3, Long>(a) - glm::vec<3, Long>(b);
        };
        const auto normal = glm::cross(sub(triangle.b, triangle.a), sub(triangle.c, triangle.a));
        const Long speed = glm::dot(glm::vec<3, Long>(direction), normal);
        const Long expected = glm::dot(sub(triangle.a, origin), normal) / speed;
        const Long tolerance = 1e-17L * std::abs(expected); // of the long doubles
        REQUIRE(std::abs(static_cast<Long>(hit.t) - expected) <= static_cast<Long>(hit.t_error) + tolerance);
        const double cosine =
            static_cast<double>(speed / (glm::length(normal) * glm::length(glm::vec<3, Long>(direction))));
        if (std::abs(cosine) > 0.1 && glm::length(normal) > 0.1L)
            CHECK(std::abs(hit.t - static_cast<double>(expected)) < 1e-13 * (1.0 + 1.0 / distance) * hit.t);
        CHECK(hit.entering == (speed < 0));
        const glm::dvec3 met = triangle.a * (1.0 - hit.uv.x - hit.uv.y) + triangle.b * hit.uv.x + triangle.c * hit.uv.y;
        if (std::abs(cosine) > 0.1 && glm::length(normal) > 0.1L)
            CHECK(glm::length(met - (origin + hit.t * direction)) < 1e-12 * (1.0 + distance));
    }
    CHECK(tested > 90000);
}

TEST_CASE("the order of triangles is exact where rounded t are equal", "[trace]")
{
    // Two walls of a wedge whose edge the ray just misses, and one in the plane of the other.
    const double tiny = 0x1p-80;
    const Triangle front{{1.0, -1.0, 0.0}, {1.0, 1.0, 0.0}, {1.0, 0.0, 1.0}};
    const Triangle back{{1.0 + tiny, -1.0, 0.0}, {1.0, 1.0, 0.0}, {1.0, 0.0, 1.0}};
    const Triangle tilted{{1.0, -1.0, 0.0}, {1.0, 1.0, 0.0}, {2.0, 0.0, 1.0}};
    const TriangleRay through_base({{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}});
    CHECK(std::is_eq(exact_order(through_base, front, back))); // 1 + 2^-80 is 1
    // In the common edge t is the same; moved by (e, e^2, e^3), upwards, the ray meets the tilted one later.
    CHECK(std::is_lt(exact_order(through_base, front, tilted)));
    CHECK(std::is_gt(exact_order(through_base, tilted, front)));
    const TriangleRay above({{0.0, 0.0, tiny}, {1.0, 0.0, 0.0}});
    CHECK(std::is_lt(exact_order(above, front, tilted)));
    const TriangleRay below({{0.0, 0.0, -tiny}, {1.0, 0.0, 0.0}});
    CHECK(std::is_gt(exact_order(below, front, tilted)));
}
