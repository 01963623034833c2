#include "catch.h"

#include "isospline/math/affine.h"
#include "isospline/math/half_space.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

using namespace isospline;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

class Random {
public:
    explicit Random(unsigned seed) : generator_(seed) {}

    double number(double lower, double upper)
    {
        return std::uniform_real_distribution<double>(lower, upper)(generator_);
    }
    glm::dvec3 vector() { return {number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0)}; }

private:
    std::mt19937 generator_;
};

} // namespace

TEST_CASE("pulled back half-spaces hold the points whose images the half-space holds", "[math]")
{
    Random random(1);
    for (int i = 0; i < 200; ++i) {
        const glm::dmat4 map(glm::dvec4(random.vector(), 0.0), glm::dvec4(random.vector(), 0.0),
                             glm::dvec4(random.vector(), 0.0), glm::dvec4(10.0 * random.vector(), 1.0));
        const double scale = std::pow(10.0, random.number(-200.0, 200.0));
        const HalfSpace half_space{scale * random.vector(), scale * random.number(-1.0, 1.0)};
        const HalfSpace pulled = pull_back(half_space, map);
        REQUIRE(glm::length(pulled.normal) == Approx(1.0));

        const glm::dvec3 point = 10.0 * random.vector();
        const double distance = glm::dot(pulled.normal, point) - pulled.offset;
        const double image = glm::dot(half_space.normal, transform_point(map, point)) - half_space.offset;
        if (std::abs(distance) > 1e-9)
            REQUIRE((distance > 0.0) == (image > 0.0));
    }
}

TEST_CASE("the half-spaces of a box are its finite sides", "[math]")
{
    const Box box{{0.0, 1.0, 2.0}, {3.0, 4.0, 5.0}};
    const auto sides = half_spaces(box);
    REQUIRE(sides.size() == 6);
    const auto holds = [&](const glm::dvec3& point) {
        for (const HalfSpace& side : sides)
            if (glm::dot(side.normal, point) < side.offset)
                return false;
        return true;
    };
    REQUIRE(holds({1.5, 2.5, 3.5}));
    REQUIRE(holds(box.lower));
    REQUIRE(holds(box.upper));
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 below = box.center(), above = box.center();
        below[axis] -= 2.0;
        above[axis] += 2.0;
        REQUIRE(!holds(below));
        REQUIRE(!holds(above));
    }

    REQUIRE(half_spaces({{0.0, -infinity, -infinity}, {infinity, 1.0, infinity}}).size() == 2);
    REQUIRE_THROWS_AS(half_spaces({{0.0, 0.0, 0.0}, {1.0, 0.0, 1.0}}), std::invalid_argument);
    REQUIRE_THROWS_AS(half_spaces({{0.0, 0.0, 0.0}, {1.0, std::nan(""), 1.0}}), std::invalid_argument);
    REQUIRE_THROWS_AS(half_spaces(Box()), std::invalid_argument);
}

TEST_CASE("a ray clipped by the sides of a box is the ray clipped by the box", "[math]")
{
    Random random(2);
    int hits = 0;
    for (int i = 0; i < 2000; ++i) {
        Box box;
        box.extend(random.vector());
        box.extend(random.vector());
        Ray ray{2.0 * random.vector(), {}, random.number(-1.0, 0.5), random.number(0.5, 3.0)};
        ray.direction = box.center() - ray.origin + 0.5 * random.vector();
        if (i % 3 == 0)
            ray.direction[i % 2] = 0.0;
        const auto expected = clip(ray, box);
        const auto found = clip(ray, half_spaces(box));
        REQUIRE(found.has_value() == expected.has_value());
        if (found) {
            ++hits;
            REQUIRE(found->t_near == Approx(expected->t_near));
            REQUIRE(found->t_far == Approx(expected->t_far));
            // Each end is the ray's own, or on the plane of the side that it names.
            const auto distance = [&](int side, double t) {
                const HalfSpace half_space = half_spaces(box).at(static_cast<std::size_t>(side));
                return glm::dot(half_space.normal, ray.at(t)) - half_space.offset;
            };
            REQUIRE((found->entry < 0) == (found->t_near == ray.t_near));
            REQUIRE((found->exit < 0) == (found->t_far == ray.t_far));
            if (found->entry >= 0)
                REQUIRE(std::abs(distance(found->entry, found->t_near)) < 1e-12);
            if (found->exit >= 0)
                REQUIRE(std::abs(distance(found->exit, found->t_far)) < 1e-12);
        }
    }
    REQUIRE(hits > 100);
}

TEST_CASE("a ray without half-spaces is whole, and a ray along a plane is on one side", "[math]")
{
    const Ray ray{{0.0, 0.0, 1.0}, {1.0, 0.0, 0.0}, 2.0, infinity};
    const auto whole = clip(ray, std::vector<HalfSpace>{});
    REQUIRE(whole);
    REQUIRE(whole->t_near == 2.0);
    REQUIRE(whole->t_far == infinity);
    REQUIRE(whole->entry == -1);
    REQUIRE(whole->exit == -1);
    const auto begun_on_plane = clip(ray, {HalfSpace{{1.0, 0.0, 0.0}, 2.0}});
    REQUIRE(begun_on_plane);
    REQUIRE(begun_on_plane->entry == 0);
    REQUIRE(clip(ray, {HalfSpace{{0.0, 0.0, 1.0}, 0.5}}));
    REQUIRE(clip(ray, {HalfSpace{{0.0, 0.0, 1.0}, 1.0}}));
    REQUIRE(!clip(ray, {HalfSpace{{0.0, 0.0, 1.0}, 1.5}}));
    REQUIRE(!clip(ray, {HalfSpace{{-1.0, 0.0, 0.0}, 0.0}}));
}

TEST_CASE("a box is on one side of a half-space, or touches its plane", "[math]")
{
    Random random(4);
    int outside = 0, inside = 0;
    for (int i = 0; i < 2000; ++i) {
        const HalfSpace half_space{glm::normalize(random.vector()), random.number(-2.0, 2.0)};
        Box box;
        box.extend(2.0 * random.vector());
        box.extend(2.0 * random.vector());
        double least = infinity, most = -infinity;
        for (int corner = 0; corner < 8; ++corner) {
            const glm::dvec3 at((corner & 1) ? box.upper.x : box.lower.x, (corner & 2) ? box.upper.y : box.lower.y,
                                (corner & 4) ? box.upper.z : box.lower.z);
            least = std::min(least, glm::dot(half_space.normal, at) - half_space.offset);
            most = std::max(most, glm::dot(half_space.normal, at) - half_space.offset);
        }
        const DistanceRange found(box, half_space);
        REQUIRE(std::abs(found.least - least) < 1e-14);
        REQUIRE(std::abs(found.most - most) < 1e-14);
        REQUIRE(is_outside(box, half_space) == (most < 0.0));
        REQUIRE(is_inside(box, half_space) == (least > 0.0));
        outside += most < 0.0;
        inside += least > 0.0;
    }
    REQUIRE(outside > 100);
    REQUIRE(inside > 100);
    const Box box{{2.0, 3.0, 4.0}, {3.0, 4.0, 5.0}};
    for (const double offset : {2.0, 2.0 + 1e-10, 3.0 - 1e-10, 3.0}) {
        REQUIRE(!is_outside(box, {{1.0, 0.0, 0.0}, offset}));
        REQUIRE(!is_inside(box, {{1.0, 0.0, 0.0}, offset}));
    }
}
