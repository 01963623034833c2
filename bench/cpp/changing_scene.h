// A level that changes.
#pragma once

#include "subjects.h"
#include "views.h"

#include <stdexcept>
#include <vector>

namespace isospline::bench {

/// A scene whose surface alternates between two levels.
class ChangingScene {
public:
    explicit ChangingScene(const BuildOptions& options = {}) : scene_(options) { scene_.add(surface_); }

    /// The scene at the other level; no bricks are made yet.
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

/// A primary ray that hits, from the middle of all rays that hit.
inline Ray middle_ray()
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

} // namespace isospline::bench
