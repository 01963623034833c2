// Another level: up to its first ray, and up to its picture, on all threads.
#include "measure.h"
#include "subjects.h"

#include "isospline/render/renderer.h"
#include "isospline/util/parallel.h"

#include <stdexcept>

namespace isospline::bench {

namespace {

/// A scene whose surface goes to and fro between two levels.
class ChangingScene {
public:
    ChangingScene() { scene_.add(surface_); }

    /// The scene at the other level, with nothing made yet that rays would make.
    std::shared_ptr<const SceneSnapshot> change()
    {
        const Volume& volume = *subject().volume;
        const double step = 0.01 * (volume.maximum() - volume.minimum());
        is_raised_ = !is_raised_;
        surface_->set_level(subject().level + (is_raised_ ? step : 0.0));
        return scene_.snapshot();
    }

private:
    std::shared_ptr<Isosurface> surface_ = make_surface();
    Scene scene_;
    bool is_raised_ = false;
};

/// A primary ray that hits, from the middle of those that do.
Ray middle_ray()
{
    const auto& hits = hits_of(Rays::whole);
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < hits.size(); ++i)
        if (hits[i])
            found.push_back(i);
    if (found.empty())
        throw std::runtime_error("subject: expected a surface that the whole view sees");
    return rays_of(Rays::whole)[found[found.size() / 2]];
}

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
