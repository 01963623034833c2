// The settled index of isosurfaces: the same hits as the draft, and when it is built.
#include "catch.h"
#include "random_rays.h"
#include "volumes.h"

#include "isospline/math/affine.h"
#include "isospline/scene/scene.h"
#include "isospline/util/progress.h"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

using namespace isospline;

namespace {

std::vector<Ray> random_rays(const Volume& volume, std::size_t count)
{
    std::mt19937 random(4);
    std::vector<Ray> rays;
    while (rays.size() < count) {
        Ray ray = random_lattice_ray(random, volume.cell_shape());
        ray.origin = transform_point(volume.lattice_to_world(), ray.origin);
        ray.direction = transform_vector(volume.lattice_to_world(), ray.direction);
        if (rays.size() % 5 == 0)
            ray.t_far = 0.8; // in the middle of a cell
        rays.push_back(ray);
    }
    return rays;
}

/// Whether two snapshots give the same answers to all kinds of queries, bit for bit.
void require_same(const SceneSnapshot& a, const SceneSnapshot& b, std::span<const Ray> rays)
{
    const auto same = [](const Hit& x, const Hit& y) {
        return x.t == y.t && x.geometry_id == y.geometry_id && x.primitive_id == y.primitive_id &&
               x.position == y.position && x.normal == y.normal && x.gradient_magnitude == y.gradient_magnitude;
    };
    std::size_t differ = 0, hits = 0;
    for (const bool coherent : {false, true}) {
        std::vector<Hit> of_a(rays.size()), of_b(rays.size());
        a.cast_rays(rays, of_a, coherent);
        b.cast_rays(rays, of_b, coherent);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            differ += same(of_a[i], of_b[i]) ? 0u : 1u;
            hits += of_a[i] ? 1u : 0u;
        }
    }
    for (const bool coherent : {false, true}) {
        std::vector<std::uint8_t> occluded_a(rays.size()), occluded_b(rays.size());
        a.test_occlusions(rays, occluded_a, coherent);
        b.test_occlusions(rays, occluded_b, coherent);
        REQUIRE(occluded_a == occluded_b);
    }
    std::vector<Crossing> crossings_a, crossings_b;
    std::vector<std::uint32_t> counts_a(rays.size()), counts_b(rays.size());
    a.list_intersections(rays, crossings_a, counts_a);
    b.list_intersections(rays, crossings_b, counts_b);
    REQUIRE(differ == 0);
    REQUIRE(hits > rays.size() / 2);
    REQUIRE(counts_a == counts_b);
    REQUIRE(crossings_a.size() == crossings_b.size());
    for (std::size_t i = 0; i < crossings_a.size(); ++i)
        differ += same(crossings_a[i].hit, crossings_b[i].hit) && crossings_a[i].entering == crossings_b[i].entering
                      ? 0u
                      : 1u;
    REQUIRE(differ == 0);
}

/// Casts rays until the index is settled; false if that does not happen within a minute.
bool is_settled_by_rays(Scene& scene, std::span<const Ray> rays)
{
    std::vector<Hit> hits(rays.size());
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (!scene.is_settled() && std::chrono::steady_clock::now() < end)
        scene.snapshot()->cast_rays(rays, hits);
    return scene.is_settled();
}

} // namespace

TEST_CASE("draft and settled index give the same answers", "[scene]")
{
    const int degree = GENERATE(1, 2, 3);
    const bool integers = GENERATE(false, true);
    const glm::ivec3 shape(21, 34, 26);
    const auto volume = integers ? integer_volume(shape, degree) : noise_volume(shape, degree);
    IsosurfaceOptions options;
    options.clip = {{{1.0, 0.5, 0.2}, 9.0}};
    options.capped = GENERATE(false, true);
    options.shell.mask.assign(static_cast<std::size_t>(shape.x * shape.y * shape.z), 1);
    for (std::size_t i = 0; i < 3000; ++i)
        options.shell.mask[i] = 0;
    Scene scene;
    scene.add(std::make_shared<Isosurface>(volume, integers ? 2.0 : 0.4, options));
    const auto draft = scene.snapshot();
    REQUIRE(!scene.is_settled());
    const auto settled = scene.settle();
    REQUIRE(scene.is_settled());
    REQUIRE(scene.snapshot() == settled);
    REQUIRE(settled->build_count() == draft->build_count());
    require_same(*draft, *settled, random_rays(*volume, 3000));
}

TEST_CASE("an index is settled in the background, and a new level drops it", "[scene]")
{
    const auto volume = noise_volume(glm::ivec3(24), 2);
    const auto surface = std::make_shared<Isosurface>(volume, 0.4);
    Scene scene;
    scene.add(surface);
    const auto draft = scene.snapshot();
    const std::vector<Ray> rays = random_rays(*volume, 2000);
    REQUIRE(is_settled_by_rays(scene, rays));
    require_same(*draft, *scene.snapshot(), rays);

    surface->set_level(-0.3);
    REQUIRE(!scene.is_settled());
    const auto next = scene.snapshot();
    REQUIRE(!scene.is_settled());
    REQUIRE(is_settled_by_rays(scene, rays));
    require_same(*next, *scene.snapshot(), rays);
}

TEST_CASE("shadow rays do not depend on a large ground that they do not meet", "[scene]")
{
    const auto volume = noise_volume(glm::ivec3(24), 2);
    const auto surface = std::make_shared<Isosurface>(volume, 0.4);
    Scene scene, with_ground;
    scene.add(surface);
    const auto alone = scene.settle();
    with_ground.share_built_objects(scene);
    with_ground.add(surface, glm::dmat4(1.0), {.camera = false, .shadow = true});
    constexpr double far = 5e4;
    const auto ground = std::make_shared<Mesh>(
        std::vector<glm::dvec3>{{-far, -far, -1.0}, {far, -far, -1.0}, {far, far, -1.0}, {-far, far, -1.0}},
        std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}});
    with_ground.add(ground, glm::dmat4(1.0), {.camera = true, .shadow = false});
    const auto both = with_ground.snapshot();
    REQUIRE(both->build_count() == 1); // of the ground
    REQUIRE(with_ground.is_settled());
    const std::vector<Ray> rays = random_rays(*volume, 2000);
    for (const bool coherent : {false, true}) {
        std::vector<std::uint8_t> expected(rays.size()), occluded(rays.size());
        alone->test_occlusions(rays, expected, coherent);
        both->test_occlusions(rays, occluded, coherent);
        REQUIRE(occluded == expected);
        REQUIRE(std::count(occluded.begin(), occluded.end(), 1) > 500);
    }
    Hit hit;
    const Ray down{{0.4 * far, -0.3 * far, 9.0}, {0.0, 0.0, -1.0}};
    both->cast_rays({&down, 1}, {&hit, 1});
    REQUIRE(hit.t == 10.0);
}

TEST_CASE("rays that gain more from a settled index begin it earlier", "[scene]")
{
    const auto volume = noise_volume(glm::ivec3(24), 2);
    const auto surface = std::make_shared<Isosurface>(volume, 0.4);
    // The surface crosses 3 x 3 x 3 bricks: these rays gain less than a settled index costs if they are traced in
    // packets, and more if they are traced one by one.
    const std::vector<Ray> rays = random_rays(*volume, 40000);
    std::vector<Hit> hits(rays.size());
    std::vector<std::uint8_t> occluded(rays.size());
    for (const bool coherent : {true, false})
        for (const bool any_hit : {true, false}) {
            Scene scene;
            scene.add(surface);
            if (any_hit)
                scene.snapshot()->test_occlusions(rays, occluded, coherent);
            else
                scene.snapshot()->cast_rays(rays, hits, coherent);
            scene.snapshot({}, 1); // does not wait for the background if it pays
            REQUIRE(scene.is_settled() == !coherent);
        }
}

TEST_CASE("a surface without any cell settles", "[scene]")
{
    Scene scene;
    scene.add(std::make_shared<Isosurface>(noise_volume(glm::ivec3(9), 2), 5.0));
    const auto snapshot = scene.settle();
    const Ray ray{{-9.0, 4.0, 4.0}, {1.0, 0.0, 0.0}};
    Hit hit;
    snapshot->cast_rays({&ray, 1}, {&hit, 1});
    REQUIRE(!hit);
    REQUIRE(scene.is_settled());
}

TEST_CASE("settling is cancelled by its progress", "[scene]")
{
    Scene scene;
    scene.add(std::make_shared<Isosurface>(noise_volume(glm::ivec3(24), 2), 0.4));
    REQUIRE_THROWS_AS(scene.settle([](double done) { return done < 0.2; }), Cancelled);
    REQUIRE(!scene.is_settled());
    REQUIRE(scene.settle() != nullptr);
}

TEST_CASE("a process that settles in the background can be forked", "[scene]")
{
    const auto volume = noise_volume(glm::ivec3(40), 2);
    Scene scene;
    scene.add(std::make_shared<Isosurface>(volume, 0.4));
    std::vector<Ray> rays = random_rays(*volume, 2000);
    std::vector<Hit> hits(rays.size());
    for (int i = 0; i < 50; ++i)
        scene.snapshot()->cast_rays(rays, hits);
    for (int i = 0; i < 5; ++i) {
        const auto begin = std::chrono::steady_clock::now();
        const pid_t child = fork();
        if (child == 0)
            _exit(0);
        REQUIRE(std::chrono::steady_clock::now() - begin < std::chrono::seconds(30)); // for a busy machine
        int status = 0;
        REQUIRE(waitpid(child, &status, 0) == child);
        REQUIRE(status == 0);
        scene.snapshot()->cast_rays(rays, hits);
    }
    REQUIRE(is_settled_by_rays(scene, rays));
}
