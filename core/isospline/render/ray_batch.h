// What camera rays meet, one surface after the other where they show through.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/trace/hit.h"

#include <glm/vec2.hpp>

#include <cstddef>
#include <functional>
#include <vector>

namespace isospline {

class SceneSnapshot;

/// One ray through each of some pixels, and what it meets first.
///
/// What a ray meets behind a translucent surface comes after all of these, ray by ray and from front to back, each hit
/// with its ray and its pixel.
struct RayBatch {
    std::vector<glm::ivec2> pixels;
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    std::vector<std::size_t> behind; ///< hits behind that of ray i: from behind[i] to behind[i + 1]; none if empty

    /// Leaves one ray for each of the first `count` pixels.
    void resize(std::size_t count);
};

/// From 0 to 1, of the surface that was hit.
using OpacityOf = std::function<double(const Hit& hit)>;

/// Appends what the rays of a batch meet up to their first opaque surface. Surfaces of opacity 0 are as if they were
/// not there: where one was met first, that hit becomes the next one, or a miss.
void append_hits_behind(RayBatch& batch, const SceneSnapshot& scene, const OpacityOf& opacity_of);

} // namespace isospline
