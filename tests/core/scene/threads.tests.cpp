#include "catch.h"

#include "volumes.h"

#include "isospline/isospline.h"

#include <glm/ext/matrix_transform.hpp>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

using namespace isospline;

namespace {

/// How long threads run: the seconds given by the environment, as in `make sanitize-thread`, or a few.
std::chrono::seconds duration()
{
    const char* const given = std::getenv("ISOSPLINE_THREADS_SECONDS");
    return std::chrono::seconds(given != nullptr ? std::stoi(given) : 3);
}

/// Runs calls repeatedly in separate threads for a while; rethrows their exceptions.
void hammer(const std::vector<std::function<void(int)>>& calls)
{
    std::atomic<bool> stop = false;
    std::mutex mutex;
    std::exception_ptr raised;
    std::vector<std::thread> threads;
    for (const auto& call : calls)
        threads.emplace_back([&] {
            try {
                for (int i = 0; !stop; ++i)
                    call(i);
            } catch (...) {
                const std::lock_guard lock(mutex);
                raised = std::current_exception();
                stop = true;
            }
        });
    for (const auto end = std::chrono::steady_clock::now() + duration();
         !stop && std::chrono::steady_clock::now() < end;)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    stop = true;
    for (std::thread& thread : threads)
        thread.join();
    if (raised)
        std::rethrow_exception(raised);
}

} // namespace

// ThreadSanitizer looks for races here; what the calls return is checked elsewhere.
TEST_CASE("all calls of all threads at a time", "[scene][threads]")
{
    const auto volume = noise_volume({20, 18, 16}, 2);
    const auto surface = std::make_shared<Isosurface>(volume, 0.1);
    IsosurfaceOptions options;
    options.clip = {{{0, 0, 1}, 4.0}};
    options.capped = true;
    const auto capped = std::make_shared<Isosurface>(volume, 0.2, options, surface->shared_ranges());
    const auto mesh =
        std::make_shared<Mesh>(std::vector<glm::dvec3>{{5, -5, -5}, {5, 25, -5}, {5, 25, 25}, {5, -5, 25}},
                               std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}});
    Scene scene;
    scene.add(surface);
    scene.add(capped);
    std::vector<Ray> rays;
    for (int i = 0; i < 256; ++i)
        rays.push_back({glm::dvec3(-20, i % 16, i / 16) + glm::dvec3(0.0, 0.3, 0.2), {1.0, 0.01, 0.02}});
    const PerspectiveCamera camera{{-40, 9, 9}, {9, 9, 9}};

    const auto change_levels = [&](int i) {
        surface->set_level(0.05 * (i % 7));
        if (i % 3 == 0)
            capped->set_level(0.04 * (i % 5));
    };
    const auto change_objects = [&](int i) {
        const std::uint32_t id = scene.add(mesh);
        scene.set_transform(id, glm::translate(glm::dmat4(1.0), glm::dvec3(i % 5, 0, 0)));
        scene.set_visibility(id, {i % 2 == 0, true});
        static_cast<void>(scene.object(id));
        scene.remove(id);
    };
    const auto query = [&](int i) {
        const auto snapshot = scene.snapshot();
        std::vector<Hit> hits(rays.size());
        snapshot->cast_rays(rays, hits, i % 2 == 0);
        std::vector<std::uint8_t> occluded(rays.size());
        snapshot->test_occlusions(rays, occluded, i % 2 != 0);
        std::vector<Crossing> crossings;
        std::vector<std::uint32_t> counts(rays.size());
        snapshot->list_intersections(rays, crossings, counts);
        for (const Hit& hit : hits)
            if (hit)
                static_cast<void>(snapshot->offset_position(hit, hit.normal));
    };
    const auto look = [&](int) {
        const auto snapshot = scene.snapshot();
        REQUIRE_FALSE(snapshot->bounds().empty());
        static_cast<void>(snapshot->memory() + snapshot->build_count() + scene.count() + scene.ids().size());
        REQUIRE(surface->shared_volume() == volume);
        const Isosurface copy(*surface);
        REQUIRE(copy.shared_ranges() == surface->shared_ranges());
    };
    const auto draw = [&](int) {
        RenderOptions picture;
        picture.size = {24, 16};
        Phong phong;
        phong.shadows = true;
        phong.opacity = 0.5;
        picture.shading = phong;
        render(*scene.snapshot(), camera, picture);
    };
    const auto trace = [&](int) {
        ProgressiveRenderer renderer(scene, camera, {16, 16}, PathTracer());
        renderer.step();
    };
    const auto measure = [&](int i) {
        const auto snapshot = surface->snapshot();
        ClosestPointFinder find(*snapshot);
        find({1.0 * (i % 20), 3.0, 4.0});
        contains(*snapshot, {1.0 * (i % 20), 3.0, 4.0});
        const VoxelHopper hopper(snapshot);
        std::vector<Hit> hits(rays.size());
        hopper.cast_rays(rays, hits);
    };
    const auto other_scene = [&](int) {
        Scene other;
        other.add(surface);
        other.add(mesh);
        std::vector<Hit> hits(rays.size());
        other.snapshot()->cast_rays(rays, hits);
    };
    hammer({change_levels, change_objects, query, query, look, draw, trace, measure, other_scene});
}

TEST_CASE("an interrupted wait for another thread's build", "[scene][threads]")
{
    Scene scene;
    scene.add(std::make_shared<Isosurface>(noise_volume({20, 18, 16}, 2), 0.1));
    std::atomic<bool> building = false, go_on = false;
    std::thread builder([&] {
        scene.snapshot([&](double) {
            building = true;
            while (!go_on)
                std::this_thread::yield();
            return true;
        });
    });
    while (!building)
        std::this_thread::yield();
    REQUIRE_THROWS_AS(scene.snapshot([](double) { return false; }), Cancelled);
    go_on = true;
    builder.join();
    REQUIRE(scene.snapshot()->build_count() == 1);
}
