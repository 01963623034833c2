// While a thread waits for a disk, no other thread waits for it unless it needs the same data.
#include "catch.h"

#include "counting_source.h"
#include "volumes.h"

#include "isospline/scene/absorption.h"
#include "isospline/scene/scene.h"

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <thread>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

using namespace isospline;

namespace {

/// A disk that does not answer while it is stuck.
class StuckDisk {
public:
    void wait()
    {
        ++waiting;
        while (is_stuck)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }

    std::atomic<bool> is_stuck = false;
    std::atomic<int> waiting = 0;
};

std::vector<Ray> parallel_rays()
{
    std::vector<Ray> rays;
    for (int i = 0; i < 256; ++i)
        rays.push_back({glm::dvec3(-20.0, 2.2 * (i % 16) + 0.3, 2.2 * (i / 16) + 0.2), {1.0, 0.01, 0.02}});
    return rays;
}

std::vector<double> distances(Scene& scene)
{
    const std::vector<Ray> rays = parallel_rays();
    std::vector<Hit> hits(rays.size());
    scene.snapshot()->cast_rays(rays, hits);
    std::vector<double> t;
    for (const Hit& hit : hits)
        t.push_back(hit.t);
    return t;
}

} // namespace

TEST_CASE("nobody waits for another thread's disk", "[scene][threads]")
{
    constexpr std::size_t limit = 60'000; // a few bricks
    const auto in_memory = noise_volume({40, 40, 40}, 2);
    const auto source = std::make_shared<CountingSource>(in_memory, limit);
    const auto other_source = std::make_shared<CountingSource>(in_memory, limit);
    const auto volume = volume_of(source, *in_memory), other_volume = volume_of(other_source, *in_memory);
    const auto disk = std::make_shared<StuckDisk>();
    source->delay = [disk] { disk->wait(); };

    Scene expected, scene, other;
    expected.add(std::make_shared<Isosurface>(in_memory, 0.1));
    const auto surface = std::make_shared<Isosurface>(volume, 0.1);
    scene.add(surface);
    const auto other_surface = std::make_shared<Isosurface>(other_volume, 0.1);
    other.add(other_surface);
    const std::vector<double> expected_t = distances(expected);
    REQUIRE(distances(scene) == expected_t); // fills the budget
    REQUIRE(source->budget()->dropped() > 0);
    // Another surface of the volume, with bricks.
    Scene also;
    const auto also_surface = std::make_shared<Isosurface>(volume, 0.3);
    also.add(also_surface);
    distances(also);

    disk->waiting = 0;
    disk->is_stuck = true;
    std::vector<std::future<std::vector<double>>> readers;
    for (int i = 0; i < 3; ++i)
        readers.push_back(std::async(std::launch::async, [&] { return distances(scene); }));
    while (disk->waiting < 3)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));

    const auto is_immediate = [](const std::function<void()>& call) {
        const auto done = std::make_shared<std::promise<void>>();
        std::thread([call, done] {
            call();
            done->set_value();
        }).detach();
        return done->get_future().wait_for(std::chrono::seconds(10)) == std::future_status::ready;
    };
    source->budget()->count_up(limit); // more than fits, so that room must be made
    const bool makes_room = is_immediate([=] { source->budget()->make_room(); });
    const bool changes_level = is_immediate([=] { also_surface->set_level(0.2); });
    const bool changes_level_of_reader = is_immediate([=] { surface->set_level(0.2); });
    const bool changes_other = is_immediate([=] { other_surface->set_level(0.2); });
    auto ends = std::make_unique<Scene>();
    ends->add(std::make_shared<Isosurface>(volume, 0.4));
    static_cast<void>(ends->snapshot());
    const bool destroys = is_immediate([ends = ends.release()] { delete ends; });
    auto other_t = std::make_shared<std::vector<double>>();
    const bool reads_other = is_immediate([&other, other_t] { *other_t = distances(other); });
    const bool forks = is_immediate([] {
        const pid_t child = fork();
        if (child == 0)
            _exit(0);
        waitpid(child, nullptr, 0);
    });
    const bool is_still_stuck = readers[0].wait_for(std::chrono::seconds(0)) == std::future_status::timeout;
    disk->is_stuck = false;
    for (auto& reader : readers)
        REQUIRE(reader.get() == expected_t);
    source->budget()->count_down(limit);

    REQUIRE(is_still_stuck);
    REQUIRE(changes_level);
    REQUIRE(changes_level_of_reader);
    REQUIRE(changes_other);
    REQUIRE(destroys);
    REQUIRE(makes_room);
    REQUIRE(reads_other);
    REQUIRE(forks);
    other_surface->set_level(0.2);
    REQUIRE(*other_t == distances(other));
}

TEST_CASE("bricks that other threads drop change neither lists nor light", "[scene][threads]")
{
    const auto in_memory = noise_volume({40, 40, 40}, 2);
    const auto source = std::make_shared<CountingSource>(in_memory, 20'000); // less than threads read at a time
    Scene expected, stored;
    expected.add(std::make_shared<Isosurface>(in_memory, 0.1));
    stored.add(std::make_shared<Isosurface>(volume_of(source, *in_memory), 0.1));
    const std::vector<Ray> rays = parallel_rays();
    const auto ask = [&rays](const SceneSnapshot& scene) {
        std::vector<Crossing> crossings;
        std::vector<std::uint32_t> counts(rays.size());
        scene.list_intersections(rays, crossings, counts, /*coherent=*/true);
        std::vector<double> answers;
        for (const Crossing& crossing : crossings)
            answers.push_back(crossing.hit.t);
        const Absorption absorption(
            scene, [](std::uint32_t) { return 0.05; }, [](const Hit&, const Ray&) { return 0.05; });
        std::vector<double> transmitted(rays.size());
        scene.attenuate_rays(rays, absorption, transmitted);
        answers.insert(answers.end(), transmitted.begin(), transmitted.end());
        return answers;
    };
    const std::vector<double> all = ask(*expected.snapshot());
    const auto snapshot = stored.snapshot();
    std::vector<std::future<int>> threads;
    for (int thread = 0; thread < 4; ++thread)
        threads.push_back(std::async(std::launch::async, [&] {
            int wrong = 0;
            for (int time = 0; time < 10; ++time)
                wrong += ask(*snapshot) != all;
            return wrong;
        }));
    for (auto& thread : threads)
        CHECK(thread.get() == 0);
    REQUIRE(source->budget()->dropped() > 0);
}
