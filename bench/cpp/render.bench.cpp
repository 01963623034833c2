// Pictures on one thread, to compare with the same rays as packets.
#include "measure.h"
#include "subjects.h"

#include "isospline/render/renderer.h"
#include "isospline/util/parallel.h"

namespace isospline::bench {

namespace {

void render(benchmark::State& state, const PerspectiveCamera& camera)
{
    RenderOptions options;
    options.size = subject().size;
    const SceneSnapshot& scene = spline_scene();
    set_thread_count(1);
    for (auto _ : state)
        benchmark::DoNotOptimize(isospline::render(scene, camera, options));
}

BENCHMARK_CAPTURE(render, phong_whole, subject().whole)->Apply(settings);
BENCHMARK_CAPTURE(render, phong_close, subject().close)->Apply(settings);

} // namespace

} // namespace isospline::bench
