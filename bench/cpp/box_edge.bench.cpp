// The edge of Embree's boxes: from one for each shell cell, the literal design, to one for each octet of bricks.
#include "changing_scene.h"
#include "measure.h"
#include "subjects.h"

#include "isospline/util/parallel.h"

#include <map>

namespace isospline::bench {

namespace {

BuildOptions options_of(const benchmark::State& state)
{
    BuildOptions options;
    options.box_edge = static_cast<int>(state.range(0));
    return options;
}

/// A scene with only the subject's surface, built when it is first needed.
const SceneSnapshot& scene_of(const benchmark::State& state)
{
    static std::map<int, std::shared_ptr<const SceneSnapshot>> scenes;
    auto& snapshot = scenes[options_of(state).box_edge];
    if (!snapshot) {
        Scene scene(options_of(state));
        scene.add(make_surface());
        snapshot = scene.snapshot();
    }
    return *snapshot;
}

void first_ray(benchmark::State& state)
{
    const Ray ray = middle_ray();
    set_thread_count(0);
    ChangingScene scene(options_of(state));
    Hit hit;
    for (auto _ : state)
        scene.change()->cast_rays({&ray, 1}, {&hit, 1});
}

void packets(benchmark::State& state)
{
    time_first_hits<Hit>(state, Rays::whole,
                         [&scene = scene_of(state)](std::span<const Ray> rays, std::span<Hit> hits) {
                             scene.cast_rays(rays, hits, true);
                         });
    state.counters["memory"] = static_cast<double>(scene_of(state).memory());
}

void ambient(benchmark::State& state)
{
    time_first_hits<Hit>(
        state, Rays::ambient,
        [&scene = scene_of(state)](std::span<const Ray> rays, std::span<Hit> hits) { scene.cast_rays(rays, hits); });
}

void edges(benchmark::internal::Benchmark* benchmark)
{
    settings(benchmark);
    for (const int edge : {1, 2, 4, 8, 16})
        benchmark->Arg(edge);
}

BENCHMARK(first_ray)->Name("box_edge/first_ray")->Apply(edges);
BENCHMARK(packets)->Name("box_edge/packets")->Apply(edges);
BENCHMARK(ambient)->Name("box_edge/ambient")->Apply(edges);

} // namespace

} // namespace isospline::bench
