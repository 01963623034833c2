// A change of the level: up to the first ray, and up to the picture, on all threads.
#include "changing_scene.h"
#include "measure.h"
#include "subjects.h"

#include "isospline/render/renderer.h"
#include "isospline/util/parallel.h"

namespace isospline::bench {

namespace {

void level(benchmark::State& state)
{
    const Ray ray = middle_ray();
    set_thread_count(0);
    ChangingScene scene;
    Hit hit;
    for (auto _ : state)
        scene.change()->cast_rays({&ray, 1}, {&hit, 1});
}

void frame(benchmark::State& state)
{
    RenderOptions options;
    options.size = subject().size;
    set_thread_count(0);
    ChangingScene scene;
    for (auto _ : state)
        benchmark::DoNotOptimize(render(*scene.change(), subject().whole, options));
}

BENCHMARK(level)->Name("level/spline_first_ray")->Apply(settings);
BENCHMARK(frame)->Name("frame/spline_new_level")->Apply(settings);

} // namespace

} // namespace isospline::bench
