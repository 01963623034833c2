// Packets of coherent rays at the isosurface.
#include "measure.h"
#include "subjects.h"

namespace isospline::bench {

namespace {

void packets(benchmark::State& state, Rays kind)
{
    time_first_hits<Hit>(state, kind, [&scene = spline_scene()](std::span<const Ray> rays, std::span<Hit> hits) {
        scene.cast_rays(rays, hits, true);
    });
}

BENCHMARK_CAPTURE(packets, spline_whole, Rays::whole)->Apply(settings);
BENCHMARK_CAPTURE(packets, spline_close, Rays::close)->Apply(settings);

} // namespace

} // namespace isospline::bench
