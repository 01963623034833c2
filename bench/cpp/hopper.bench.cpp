// The same rays by voxel hopping with the paper's root finder (§3, §4): the baseline.
#include "measure.h"
#include "subjects.h"

#include "isospline/hopper/hopper.h"

namespace isospline::bench {

namespace {

const VoxelHopper& paper_hopper()
{
    static const VoxelHopper hopper(make_surface(Method::bracket)->snapshot());
    return hopper;
}

void hopping(benchmark::State& state, Rays kind)
{
    time_first_hits<Hit>(state, kind, [&hopper = paper_hopper()](std::span<const Ray> rays, std::span<Hit> hits) {
        hopper.cast_rays(rays, hits);
    });
}

BENCHMARK_CAPTURE(hopping, spline_whole, Rays::whole)->Apply(settings);
BENCHMARK_CAPTURE(hopping, spline_close, Rays::close)->Apply(settings);

} // namespace

} // namespace isospline::bench
