// Rays at the isosurface one after the other: first hits and occlusions.
#include "measure.h"
#include "subjects.h"

namespace isospline::bench {

namespace {

void single_rays(benchmark::State& state, Rays kind)
{
    time_first_hits<Hit>(state, kind, [&scene = spline_scene()](std::span<const Ray> rays, std::span<Hit> hits) {
        scene.cast_rays(rays, hits);
    });
}

void occlusions(benchmark::State& state, Rays kind)
{
    time_occlusions(state, kind,
                    [&scene = spline_scene()](std::span<const Ray> rays, std::span<std::uint8_t> occluded) {
                        scene.test_occlusions(rays, occluded);
                    });
}

BENCHMARK_CAPTURE(single_rays, spline_whole, Rays::whole)->Apply(settings);
BENCHMARK_CAPTURE(single_rays, spline_close, Rays::close)->Apply(settings);
BENCHMARK_CAPTURE(single_rays, spline_ambient, Rays::ambient)->Apply(settings);
BENCHMARK_CAPTURE(occlusions, spline_ambient, Rays::ambient)->Apply(settings);

} // namespace

} // namespace isospline::bench
