// The same rays at Embree's own triangles.
#include "embree_triangles.h"
#include "measure.h"

namespace isospline::bench {

namespace {

void packets(benchmark::State& state, Rays kind)
{
    time_first_hits<TriangleHit>(state, kind,
                                 [&scene = triangle_scene()](std::span<const Ray> rays, std::span<TriangleHit> hits) {
                                     scene.cast_packets(rays, hits);
                                 });
}

void single_rays(benchmark::State& state, Rays kind)
{
    time_first_hits<TriangleHit>(state, kind,
                                 [&scene = triangle_scene()](std::span<const Ray> rays, std::span<TriangleHit> hits) {
                                     scene.cast_singles(rays, hits);
                                 });
}

void occlusions(benchmark::State& state, Rays kind)
{
    time_occlusions(state, kind,
                    [&scene = triangle_scene()](std::span<const Ray> rays, std::span<std::uint8_t> occluded) {
                        scene.test_occlusions(rays, occluded);
                    });
}

BENCHMARK_CAPTURE(packets, triangles_whole, Rays::whole)->Apply(settings);
BENCHMARK_CAPTURE(packets, triangles_close, Rays::close)->Apply(settings);
BENCHMARK_CAPTURE(single_rays, triangles_whole, Rays::whole)->Apply(settings);
BENCHMARK_CAPTURE(single_rays, triangles_close, Rays::close)->Apply(settings);
BENCHMARK_CAPTURE(single_rays, triangles_ambient, Rays::ambient_of_triangles)->Apply(settings);
BENCHMARK_CAPTURE(occlusions, triangles_ambient, Rays::ambient_of_triangles)->Apply(settings);

} // namespace

} // namespace isospline::bench
