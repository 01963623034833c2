#include "isospline/scene/scene_points.h"

#include "catch.h"
#include "closed_meshes.h"
#include "volumes.h"

#include "isospline/scene/scene.h"

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <vector>

using namespace isospline;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// f = 36 - |x - 10|^2, exactly: a ball of radius 6 about (10, 10, 10).
std::shared_ptr<Isosurface> ball()
{
    std::vector<float> samples;
    for (int z = 0; z < 21; ++z)
        for (int y = 0; y < 21; ++y)
            for (int x = 0; x < 21; ++x) {
                const glm::dvec3 r = glm::dvec3(x, y, z) - 10.0;
                samples.push_back(static_cast<float>(36.0 - glm::dot(r, r) + 0.75));
            }
    VolumeOptions options;
    options.filter = Filter::none;
    const auto volume = make_volume(samples, {21, 21, 21}, options);
    return std::make_shared<Isosurface>(volume, 0.0);
}

std::shared_ptr<const Mesh> mesh_of(const test::ClosedMesh& closed)
{
    return std::make_shared<const Mesh>(closed.vertices, closed.faces);
}

glm::dmat4 moved(const glm::dvec3& by)
{
    return glm::translate(glm::dmat4(1.0), by);
}

std::vector<glm::dvec3> random_points(std::size_t count, double lower, double upper)
{
    std::mt19937 random(11);
    std::uniform_real_distribution<double> number(lower, upper);
    std::vector<glm::dvec3> points;
    for (std::size_t i = 0; i < count; ++i)
        points.emplace_back(number(random), number(random), number(random));
    return points;
}

/// Of a box about the origin.
double distance_from_box(const glm::dvec3& point, const glm::dvec3& half_size)
{
    const glm::dvec3 beyond = glm::abs(point) - half_size;
    const double inside = std::min(0.0, std::max({beyond.x, beyond.y, beyond.z}));
    return std::abs(glm::length(glm::max(beyond, glm::dvec3(0.0))) + inside);
}

} // namespace

TEST_CASE("the nearest point of a scene is that of the nearest object", "[scene]")
{
    // A ball, scaled and moved, and a box that is mirrored.
    const glm::dmat4 ball_placed = glm::scale(moved({1, 2, 3}), glm::dvec3(0.5));
    const glm::dmat4 box_placed = glm::scale(moved({-4, 0, 0}), glm::dvec3(-1, 2, 1));
    Scene scene;
    const std::uint32_t ball_id = scene.add(ball(), ball_placed);
    const std::uint32_t box_id = scene.add(mesh_of(test::box({1.0, 0.7, 0.4}).subdivided()), box_placed);
    const auto snapshot = scene.snapshot();
    SceneClosestPointFinder find(*snapshot);
    for (const glm::dvec3& point : random_points(400, -12.0, 12.0)) {
        const double to_ball = std::abs(glm::length(point - glm::dvec3(6, 7, 8)) - 3.0);
        const double to_box = distance_from_box(point - glm::dvec3(-4, 0, 0), {1.0, 1.4, 0.4});
        const SceneClosestPoint found = find(point);
        REQUIRE(found.geometry_id == (to_ball < to_box ? ball_id : box_id));
        REQUIRE(found.distance == Approx(std::min(to_ball, to_box)).margin(1e-6));
        REQUIRE(glm::length(found.position - point) == Approx(found.distance).margin(1e-9));
        REQUIRE(glm::length(found.normal) == Approx(1.0));
        // Normals point outwards, also of what is mirrored.
        const glm::dvec3 center = to_ball < to_box ? glm::dvec3(6, 7, 8) : glm::dvec3(-4, 0, 0);
        REQUIRE(glm::dot(found.normal, found.position - center) > 0.0);
    }
}

TEST_CASE("nothing is found beyond the largest distance, nor on objects that the camera does not see", "[scene]")
{
    Scene scene;
    const std::uint32_t id = scene.add(mesh_of(test::box(glm::dvec3(1.0))));
    const auto held = scene.snapshot();
    SceneClosestPointFinder find(*held, {.max_distance = 2.0});
    REQUIRE(find({2.9, 0, 0}).distance == Approx(1.9));
    REQUIRE(find({3.1, 0, 0}).distance == infinity);
    REQUIRE(find({3.1, 0, 0}).geometry_id == 0xffffffffu);
    scene.set_visibility(id, {.camera = false, .shadow = true});
    const auto hidden = scene.snapshot();
    REQUIRE(SceneClosestPointFinder(*hidden)({2.0, 0, 0}).distance == infinity);
    const std::vector<glm::dvec3> middle{{0.1, 0.2, 0.3}};
    std::vector<std::uint8_t> occupied(1, 9);
    find_occupancy(*hidden, middle, occupied);
    REQUIRE(occupied[0] == 0);
}

TEST_CASE("of several equally near objects, the one with the smallest id is returned", "[scene]")
{
    Scene scene;
    const auto box = mesh_of(test::box(glm::dvec3(1.0)));
    scene.add(box);
    scene.add(box);
    scene.add(ball());
    scene.add(ball());
    const auto snapshot = scene.snapshot();
    SceneClosestPointFinder find(*snapshot);
    REQUIRE(find({-3, 0.1, 0.2}).geometry_id == 0);
    REQUIRE(find({10, 10, 17}).geometry_id == 2);
}

TEST_CASE("points are in a solid, in a closed mesh, or in neither", "[scene]")
{
    const glm::dmat4 placed = moved({-6, 0, 0});
    Scene scene;
    scene.add(ball());
    scene.add(mesh_of(test::tube(1, 0.3, 24, 48)), placed);
    scene.add(mesh_of(test::box(glm::dvec3(1.0))), moved({-6, 0, 4}));
    const auto snapshot = scene.snapshot();
    const auto points = random_points(3000, -9.0, 18.0);
    std::vector<std::uint8_t> occupied(points.size());
    find_occupancy(*snapshot, points, occupied);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double ball_distance = glm::length(points[i] - 10.0) - 6.0;
        const glm::dvec3 p = points[i] - glm::dvec3(-6, 0, 0), in_box = glm::abs(p - glm::dvec3(0, 0, 4)) - 1.0;
        const double box_distance = std::max({in_box.x, in_box.y, in_box.z});
        const double ring = glm::length(glm::dvec2(glm::length(glm::dvec2(p)) - 0.7, p.z)) - 0.3;
        if (std::abs(ring) < 0.02 || std::abs(ball_distance) < 1e-6 || std::abs(box_distance) < 1e-9)
            continue; // the tube has facets
        REQUIRE(occupied[i] == static_cast<std::uint8_t>(ball_distance < 0.0 || box_distance < 0.0 || ring < 0.0));
    }
}
