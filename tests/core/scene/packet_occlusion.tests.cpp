// Coherent rays are occluded where rays that are traced one by one are, and lose light at all of their crossings.
#include "catch.h"
#include "long_tests.h"
#include "random_rays.h"
#include "volumes.h"

#include "isospline/math/affine.h"
#include "isospline/scene/absorption.h"
#include "isospline/scene/ray_caster.h"
#include "isospline/scene/scene.h"

#include <glm/ext/matrix_transform.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <vector>

using namespace isospline;

namespace {

std::vector<std::uint8_t> occlusions(const SceneSnapshot& scene, std::span<const Ray> rays, bool coherent)
{
    std::vector<std::uint8_t> occluded(rays.size());
    scene.test_occlusions(rays, occluded, coherent);
    return occluded;
}

/// Rays to a light from all hits of random rays, from their positions themselves or from beside the surface, and the
/// random rays.
std::vector<Ray> rays_to_light(const SceneSnapshot& scene, const Volume& volume, const glm::dvec3& light)
{
    std::mt19937 random(3);
    std::vector<Ray> rays(are_tests_long() ? 4000 : 400), all;
    for (Ray& ray : rays) {
        ray = random_lattice_ray(random, volume.cell_shape());
        ray.origin = transform_point(volume.lattice_to_world(), ray.origin);
        ray.direction = transform_vector(volume.lattice_to_world(), ray.direction);
    }
    std::vector<Hit> hits(rays.size());
    scene.cast_rays(rays, hits);
    for (const Hit& hit : hits) {
        if (!hit)
            continue;
        const glm::dvec3 offset = scene.offset_position(hit, light - hit.position);
        all.push_back({offset, light - offset, 0.0, 1.0});
        all.push_back({hit.position, light - hit.position, 0.0, 1.0});
    }
    all.insert(all.end(), rays.begin(), rays.end());
    return all;
}

/// Those of objects with odd ids differ from point to point.
std::optional<double> even_opacity(std::uint32_t id)
{
    return id % 2 == 0 ? std::optional(0.3 + 0.05 * id) : std::nullopt;
}

double opacity_of(const Hit& hit, const Ray& ray)
{
    const std::optional<double> even = even_opacity(hit.geometry_id);
    const bool first_half = hit.primitive_id % 2 == 0;
    return even ? *even
                : 0.2 + (first_half ? 0.3 : 0.5) * std::abs(glm::dot(hit.normal, glm::normalize(ray.direction)));
}

/// The opacity of an object, or nothing if it differs from point to point.
using EvenOpacity = std::optional<double> (*)(std::uint32_t);

/// With a threshold, a ray transmits all if at least this part of the light is left, and nothing otherwise.
void require_all_or_nothing(const std::vector<Ray>& rays, const SceneSnapshot& scene, const Absorption& absorption,
                            const std::vector<double>& left)
{
    std::vector<double> transmitted(rays.size()), thresholds(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i)
        thresholds[i] = 1.0 - std::fmod(static_cast<double>(i) * 0.618, 1.0) * (i % 7 != 0 ? 1.0 : 0.0);
    thresholds[1] = 0.0;
    scene.attenuate_rays(rays, absorption, transmitted, thresholds);
    REQUIRE(transmitted[1] == left[1]);
    std::size_t wrong = 0, all = 0;
    for (std::size_t i = 2; i < rays.size(); ++i) {
        const bool at_limit = std::abs(left[i] - thresholds[i]) < 1e-11 && left[i] < 1.0;
        wrong += !at_limit && transmitted[i] != (left[i] >= thresholds[i] && left[i] > 0.0 ? 1.0 : 0.0);
        all += transmitted[i] == 1.0;
    }
    REQUIRE(wrong == 0);
    REQUIRE(all > rays.size() / 10);
    REQUIRE(all < rays.size());
}

/// The light that is left is the product over the list of all crossings.
void require_product(const std::vector<Ray>& rays, const SceneSnapshot& scene, EvenOpacity even)
{
    const Absorption absorption(scene, even, opacity_of);
    std::vector<double> transmitted(rays.size());
    scene.attenuate_rays(rays, absorption, transmitted);
    std::vector<Crossing> crossings;
    std::vector<std::uint32_t> counts(rays.size());
    scene.list_intersections(rays, crossings, counts);
    auto crossing = crossings.begin();
    std::size_t wrong = 0, dark = 0, dim = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        double expected = 1.0;
        for (const auto end = crossing + counts[i]; crossing != end; ++crossing)
            if (scene.object(crossing->hit.geometry_id).seen_by.shadow)
                expected *= 1.0 - even(crossing->hit.geometry_id).value_or(opacity_of(crossing->hit, rays[i]));
        dark += expected < 0.01;
        dim += expected >= 0.01 && expected < 1.0;
        const bool at_limit = std::abs(expected - 0.01) < 1e-11;
        wrong += !at_limit && !(std::abs(transmitted[i] - (expected < 0.01 ? 0.0 : expected)) < 1e-11);
    }
    REQUIRE(wrong == 0);
    REQUIRE(dark + dim > rays.size() / 10);
    REQUIRE(dim > rays.size() / 20);
    require_all_or_nothing(rays, scene, absorption, transmitted);
}

bool is_same_crossing(const Crossing& a, const Crossing& b)
{
    return a.entering == b.entering && a.hit.t == b.hit.t && a.hit.geometry_id == b.hit.geometry_id &&
           a.hit.primitive_id == b.hit.primitive_id && a.hit.position == b.hit.position &&
           a.hit.normal == b.hit.normal && a.hit.gradient_magnitude == b.hit.gradient_magnitude && a.hit.uv == b.hit.uv;
}

/// Coherent rays have the lists of rays that are traced one by one.
void require_same_lists(const std::vector<Ray>& rays, const SceneSnapshot& scene)
{
    std::vector<Crossing> single, coherent;
    std::vector<std::uint32_t> counts(rays.size()), coherent_counts(rays.size());
    scene.list_intersections(rays, single, counts);
    scene.list_intersections(rays, coherent, coherent_counts, true);
    REQUIRE(coherent_counts == counts);
    REQUIRE(std::equal(single.begin(), single.end(), coherent.begin(), coherent.end(), is_same_crossing));
}

/// Lists of what is seen begin like lists of all crossings, as long as light is left, and end soon after: they have at
/// most a part of the rest.
void require_visible_lists(const std::vector<Ray>& rays, const SceneSnapshot& scene,
                           const std::function<std::optional<double>(std::uint32_t)>& opacity, double part = 0.25)
{
    std::vector<Crossing> all, seen;
    std::vector<std::uint32_t> counts(rays.size()), seen_counts(rays.size());
    scene.list_intersections(rays, all, counts);
    const Absorption absorption(scene, opacity, opacity_of);
    RayCaster caster(scene, RayCaster::Rays::coherent);
    caster.list(rays, seen, seen_counts, &absorption);
    auto crossing = all.begin(), listed = seen.begin();
    std::size_t wrong = 0, needed_count = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        std::size_t needed = 0;
        for (double left = 1.0; needed < counts[i] && left >= Absorption::least_visible; ++needed)
            left *= 1.0 - opacity(crossing[static_cast<std::ptrdiff_t>(needed)].hit.geometry_id).value_or(0.0);
        const auto needed_end = crossing + static_cast<std::ptrdiff_t>(needed);
        wrong += seen_counts[i] < needed || !std::equal(crossing, needed_end, listed, is_same_crossing);
        needed_count += needed;
        crossing += counts[i];
        listed += seen_counts[i];
    }
    REQUIRE(wrong == 0);
    REQUIRE(seen.size() >= needed_count);
    REQUIRE(static_cast<double>(seen.size() - needed_count) <= part * static_cast<double>(all.size() - needed_count));

    // The caster answers other questions afterwards.
    RayPacket packet;
    packet.count = caster.width();
    for (int lane = 0; lane < packet.count; ++lane)
        packet.set(lane, rays[static_cast<std::size_t>(lane)]);
    const std::vector<std::uint8_t> occluded = occlusions(scene, rays, false);
    const LaneMask lanes = caster.test_occlusions(packet, 0);
    for (int lane = 0; lane < packet.count; ++lane)
        REQUIRE((lanes >> lane & 1u) == occluded[static_cast<std::size_t>(lane)]);
}

void require_same(const std::vector<Ray>& rays, const SceneSnapshot& scene)
{
    require_product(rays, scene, even_opacity);
    require_product(rays, scene, [](std::uint32_t id) { return std::optional(0.3 + 0.05 * id); });
    require_same_lists(rays, scene);
    require_visible_lists(rays, scene, even_opacity);
    require_visible_lists(rays, scene, [](std::uint32_t id) { return id % 2 == 0 ? 0.95 : 0.2; });
    require_visible_lists(rays, scene, [](std::uint32_t id) { return id % 2 == 0 ? 0.4 : 1.0; });
    const std::vector<std::uint8_t> single = occlusions(scene, rays, false);
    const auto occluded = static_cast<std::size_t>(std::count(single.begin(), single.end(), 1));
    REQUIRE(occluded > rays.size() / 10);
    REQUIRE(occluded < rays.size() - rays.size() / 50);
    REQUIRE(occlusions(scene, rays, true) == single);
}

/// In the draft and in the settled index.
void require_same(Scene& scene, const Volume& volume, const glm::dvec3& light)
{
    const auto draft = scene.snapshot();
    const std::vector<Ray> rays = rays_to_light(*draft, volume, light);
    require_same(rays, *draft);
    require_same(rays, *scene.settle());
}

} // namespace

TEST_CASE("coherent rays to a light: a surface alone", "[scene]")
{
    const int degree = GENERATE(1, 2, 3);
    const bool ties = GENERATE(false, true);
    const glm::ivec3 shape(25, 24, 26);
    const auto volume = ties ? integer_volume(shape, degree) : noise_volume(shape, degree);
    IsosurfaceOptions options;
    options.method = GENERATE(Method::exact, Method::reference);
    Scene scene;
    scene.add(std::make_shared<Isosurface>(volume, ties ? 2.0 : 0.85, options));
    require_same(scene, *volume, {40.0, 30.0, 50.0});
}

TEST_CASE("coherent rays to a light begin in cells that are cut away", "[scene]")
{
    const int degree = GENERATE(1, 2, 3);
    const auto volume = noise_volume({25, 24, 26}, degree);
    IsosurfaceOptions options;
    if (GENERATE(false, true)) {
        options.shell.mask.resize(static_cast<std::size_t>(25 * 24 * 26));
        for (std::size_t i = 0; i < options.shell.mask.size(); ++i)
            options.shell.mask[i] = i % 29 != 0;
    } else {
        options.largest = 1;
    }
    Scene uncut, cut;
    uncut.add(std::make_shared<Isosurface>(volume, 0.0));
    cut.add(std::make_shared<Isosurface>(volume, 0.0, options));
    const std::vector<Ray> rays = rays_to_light(*uncut.snapshot(), *volume, {40.0, 30.0, 50.0});
    require_same(rays, *cut.snapshot());
    require_same(rays, *cut.settle());
}

TEST_CASE("coherent rays to a light: clips and caps", "[scene]")
{
    const int degree = GENERATE(1, 2, 3);
    const auto volume = noise_volume({25, 24, 26}, degree);
    IsosurfaceOptions options;
    options.clip = {{{1.0, 0.5, 0.2}, 9.0}, {{0.0, -1.0, 0.0}, -20.0}};
    options.capped = GENERATE(false, true);
    options.closed = GENERATE(false, true);
    Scene scene;
    scene.add(std::make_shared<Isosurface>(volume, 0.6, options));
    require_same(scene, *volume, {40.0, 30.0, 50.0});
}

TEST_CASE("coherent rays to a light: instances and meshes", "[scene]")
{
    const int degree = GENERATE(1, 2, 3);
    const auto volume = noise_volume({25, 24, 26}, degree), other = noise_volume({20, 21, 19}, degree);
    IsosurfaceOptions capped;
    capped.clip = {{{1.0, 0.5, 0.2}, 9.0}};
    capped.capped = true;
    const auto mesh = std::make_shared<Mesh>(
        std::vector<glm::dvec3>{{0.0, 0.0, 0.0}, {20.0, 0.0, 5.0}, {0.0, 20.0, 9.0}, {20.0, 20.0, 25.0}},
        std::vector<glm::uvec3>{{0, 1, 2}, {1, 3, 2}});
    const glm::dmat4 moved = glm::translate(glm::dmat4(1.0), {4.0, 3.0, 2.0});
    Scene scene;
    const auto surface = std::make_shared<Isosurface>(volume, 0.9);
    scene.add(surface);
    scene.add(surface, glm::rotate(moved, 0.6, {1.0, 2.0, 0.5}));
    scene.add(std::make_shared<Isosurface>(other, 0.8, capped), moved);
    scene.add(mesh);
    scene.add(mesh, glm::scale(moved, {1.0, -0.7, 1.0}), {true, GENERATE(false, true)});
    require_same(scene, *volume, {40.0, 30.0, 50.0});

    Scene meshes;
    meshes.add(mesh);
    require_same(meshes, *volume, {40.0, 30.0, 50.0});
}

TEST_CASE("visible crossings are listed where nothing tells which one is first", "[scene]")
{
    // The last three faces are the first two with their corners in another order. Both objects are there twice.
    const auto mesh = std::make_shared<Mesh>(
        std::vector<glm::dvec3>{{0.0, 0.0, 0.1}, {20.0, 0.0, 5.3}, {0.0, 20.0, 9.7}, {20.0, 20.0, 25.1}},
        std::vector<glm::uvec3>{{0, 1, 2}, {1, 3, 2}, {2, 0, 1}, {3, 2, 1}, {2, 1, 0}});
    const auto volume = noise_volume({25, 24, 26}, 2);
    const auto surface = std::make_shared<Isosurface>(volume, 0.9);
    Scene scene;
    for (int i = 0; i < 2; ++i) {
        scene.add(mesh);
        scene.add(surface, glm::translate(glm::dmat4(1.0), {i * 1e-13, 0.0, 0.0}));
    }
    const auto snapshot = scene.settle();
    std::vector<Ray> rays = rays_to_light(*snapshot, *volume, {40.0, 30.0, 50.0});
    for (std::size_t i = 0; i < rays.size(); i += 3) { // from far away, where numbers of t are far apart
        rays[i].direction = glm::normalize(rays[i].direction);
        rays[i].origin -= 1e7 * rays[i].direction;
        rays[i].t_far = 1e9;
    }
    constexpr double tied = 0.5; // most crossings are twice or more often at the same place, and stay together
    require_visible_lists(
        rays, *snapshot, [](std::uint32_t id) { return id < 2 ? 1.0 : 0.4; }, tied);
    require_visible_lists(
        rays, *snapshot, [](std::uint32_t id) { return id < 2 ? 0.4 : 1.0; }, tied);
    require_visible_lists(
        rays, *snapshot, [](std::uint32_t id) { return id % 2 == 0 ? 0.97 : 0.6; }, tied);
}
