#include "isospline/scene/ray_coherence.h"

#include "catch.h"

#include "volumes.h"

#include "isospline/scene/scene.h"

#include <glm/gtc/matrix_transform.hpp>

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

using namespace isospline;

namespace {

constexpr int edge = 64; // cells of the volume, one a unit

std::shared_ptr<const SceneSnapshot> noise()
{
    Scene scene;
    scene.add(std::make_shared<Isosurface>(noise_volume({edge, edge, edge}, 2), 0.1));
    return scene.snapshot();
}

/// Rays along x, from a picture of the given number of pixels a side.
std::vector<Ray> picture(int pixels)
{
    std::vector<Ray> rays;
    for (int row = 0; row < pixels; ++row)
        for (int column = 0; column < pixels; ++column)
            rays.push_back({{-20.0, edge * (column + 0.5) / pixels, edge * (row + 0.5) / pixels}, {2.0, 0.0, 0.0}});
    return rays;
}

RayAt in(const std::vector<Ray>& rays)
{
    return [&rays](std::size_t i) { return rays[i]; };
}

} // namespace

TEST_CASE("rays are close to each other, far from each other, or in between", "[scene]")
{
    const auto snapshot = noise();
    const RayCoherence& coherence = snapshot->coherence(&SeenBy::camera);
    const auto closeness = [&](const std::vector<Ray>& rays) { return coherence.closeness(rays.size(), in(rays)); };

    REQUIRE(closeness(picture(256)) == RayCoherence::Closeness::packets);
    REQUIRE(closeness(picture(64)) == RayCoherence::Closeness::sorting); // rows of 15 cells
    REQUIRE(closeness(picture(32)) == RayCoherence::Closeness::none);

    std::vector<Ray> shuffled = picture(256);
    std::mt19937 random(1);
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    // The box is 64 cells wide: rays of a group are not so far from each other that sorting pays.
    REQUIRE(closeness(shuffled) != RayCoherence::Closeness::packets);

    std::vector<Ray> scattered = picture(256);
    std::normal_distribution<double> normal;
    for (Ray& ray : scattered) {
        ray.origin.x = 30.0;
        ray.direction = {normal(random), normal(random), normal(random)};
    }
    REQUIRE(closeness(scattered) == RayCoherence::Closeness::none);

    REQUIRE(closeness({}) == RayCoherence::Closeness::none);
    REQUIRE(closeness(std::vector<Ray>(15, Ray{{-20.0, 3.0, 3.0}, {1.0, 0.0, 0.0}})) == RayCoherence::Closeness::none);
    REQUIRE(closeness(std::vector<Ray>(16, Ray{{-20.0, 3.0, 3.0}, {1.0, 0.0, 0.0}})) ==
            RayCoherence::Closeness::packets);
    // Rays that miss the volume, and rays that cannot be cast.
    REQUIRE(closeness(std::vector<Ray>(64, Ray{{-20.0, -3.0, 3.0}, {1.0, 0.0, 0.0}})) == RayCoherence::Closeness::none);
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    REQUIRE(closeness(std::vector<Ray>(64, Ray{{nan, 3.0, 3.0}, {1.0, 0.0, 0.0}})) == RayCoherence::Closeness::none);
    REQUIRE(closeness(std::vector<Ray>(64, Ray{{0.0, 3.0, 3.0}, {0.0, nan, 0.0}})) == RayCoherence::Closeness::none);
}

TEST_CASE("sorted rays are the same rays, and close to each other", "[scene]")
{
    const auto snapshot = noise();
    const RayCoherence& coherence = snapshot->coherence(&SeenBy::camera);
    std::vector<Ray> rays = picture(400); // more than one block of rays that are sorted
    std::mt19937 random(1);
    std::shuffle(rays.begin(), rays.end(), random);
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    rays[7] = {{nan, 0.0, 0.0}, {1.0, 0.0, 0.0}};
    rays[8] = {{0.0, 0.0, 0.0}, {nan, 0.0, 0.0}};
    rays[9] = {{-20.0, -3.0, 3.0}, {1.0, 0.0, 0.0}};
    std::vector<std::size_t> order = coherence.sorted(rays.size(), in(rays), {});

    std::vector<Ray> sorted;
    for (const std::size_t place : order)
        sorted.push_back(rays[place]);
    REQUIRE(coherence.closeness(sorted.size(), in(sorted)) == RayCoherence::Closeness::packets);
    std::sort(order.begin(), order.end());
    std::vector<std::size_t> all(rays.size());
    std::iota(all.begin(), all.end(), std::size_t(0));
    REQUIRE(order == all);
}

TEST_CASE("rays at a scene without isosurfaces are compared with its triangles, at an empty scene not", "[scene]")
{
    Scene scene;
    const std::vector<Ray> rays = picture(256);
    const auto closeness = [&](bool SeenBy::*sees) {
        return scene.snapshot()->coherence(sees).closeness(rays.size(), in(rays));
    };
    REQUIRE(closeness(&SeenBy::camera) == RayCoherence::Closeness::none);
    const std::vector<glm::dvec3> corners{{30.0, 0.0, 0.0}, {31.0, edge, 0.0}, {30.0, 0.0, edge}};
    const auto mesh = std::make_shared<Mesh>(corners, std::vector<glm::uvec3>{{0, 1, 2}});
    const std::uint32_t id = scene.add(mesh);
    REQUIRE(closeness(&SeenBy::camera) == RayCoherence::Closeness::packets);
    scene.set_visibility(id, {.camera = false, .shadow = true});
    REQUIRE(closeness(&SeenBy::camera) == RayCoherence::Closeness::none);
    REQUIRE(closeness(&SeenBy::shadow) == RayCoherence::Closeness::packets);
}

TEST_CASE("the largest isosurface tells whether rays are close to each other", "[scene]")
{
    Scene scene;
    scene.add(std::make_shared<Isosurface>(noise_volume({edge, edge, edge}, 2), 0.1));
    const auto small = std::make_shared<Isosurface>(noise_volume({8, 8, 8}, 2), 0.1);
    scene.add(small, glm::scale(glm::dmat4(1.0), glm::dvec3(1e-3)));
    const std::vector<Ray> rays = picture(256);
    REQUIRE(scene.snapshot()->coherence(&SeenBy::camera).closeness(rays.size(), in(rays)) ==
            RayCoherence::Closeness::packets);
}
