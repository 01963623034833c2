#include "catch.h"

#include "noise_volume.h"

#include "isospline/brick/cutout.h"
#include "isospline/math/affine.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

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

TEST_CASE("pulled back half-spaces hold the points whose images the half-space holds", "[brick]")
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

TEST_CASE("the half-spaces of a box are its finite sides", "[brick]")
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

TEST_CASE("a ray clipped by the sides of a box is the ray clipped by the box", "[brick]")
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

TEST_CASE("a ray without half-spaces is whole, and a ray along a plane is on one side", "[brick]")
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

TEST_CASE("half-spaces cut the cells away that have no corner inside", "[brick]")
{
    Random random(3);
    const Brick brick{{8, 16, 24}, {8, 8, 8}};
    for (int i = 0; i < 300; ++i) {
        const glm::dvec3 normal = glm::normalize(random.vector());
        const glm::dvec3 point = glm::dvec3(12.0, 20.0, 28.0) + 8.0 * random.vector();
        const HalfSpace half_space{normal, glm::dot(normal, point)};
        BrickCells cells, expected;
        cells.fill(~std::uint64_t(0));
        expected = cells;
        remove_cells(expected, [&](int x, int y, int z) {
            for (int corner = 0; corner < 8; ++corner) {
                const glm::ivec3 at(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
                if (glm::dot(normal, glm::dvec3(brick.first + at)) >= half_space.offset)
                    return false;
            }
            return true;
        });
        cut_by_half_space(cells, brick, half_space);
        REQUIRE(cells == expected);
    }
}

TEST_CASE("cells that touch a half-space stay", "[brick]")
{
    BrickCells cells;
    cells.fill(~std::uint64_t(0));
    cut_by_half_space(cells, {{0, 0, 0}, {8, 8, 8}}, {{0.0, 0.0, 1.0}, 5.0});
    for (std::size_t z = 0; z < 8; ++z)
        REQUIRE((cells[z] != 0) == (z >= 4));
}

TEST_CASE("a mask cuts cells away by their centre or by any corner", "[brick]")
{
    for (int degree = 1; degree <= 3; ++degree) {
        const auto volume = noise_volume({10, 5, 4}, degree);
        Mask mask(10 * 5 * 4, 1);
        mask[8 + 10 * (2 + 5 * 1)] = 0;
        std::vector<glm::ivec3> removed;
        for (int index = 0; index < 2; ++index) {
            const Brick brick = brick_at(volume->cell_shape(), {index, 0, 0});
            BrickCells cells{};
            for (int z = 0; z < brick.size.z; ++z)
                for (int y = 0; y < brick.size.y; ++y)
                    cells[static_cast<std::size_t>(z)] |= ((std::uint64_t(1) << brick.size.x) - 1) << 8 * y;
            BrickCells left = cells;
            cut_by_mask(left, brick, mask, *volume);
            for (std::size_t z = 0; z < 8; ++z)
                cells[z] &= ~left[z];
            for_each_cell(cells, [&](int x, int y, int z) { removed.push_back(brick.first + glm::ivec3(x, y, z)); });
        }
        if (degree == 2) {
            REQUIRE(removed == std::vector<glm::ivec3>{{8, 2, 1}});
        } else {
            REQUIRE(removed.size() == 8);
            for (const glm::ivec3& cell : removed)
                REQUIRE((glm::ivec3(8, 2, 1) - cell == glm::clamp(glm::ivec3(8, 2, 1) - cell, 0, 1)));
        }
    }
}
