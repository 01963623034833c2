// The visibility of lights and of the sky from hits, through translucent surfaces.
#pragma once

#include "isospline/render/ray_batch.h"
#include "isospline/render/renderer.h"
#include "isospline/scene/absorption.h"
#include "isospline/shade/shading.h"
#include "isospline/trace/hit.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace isospline {

class SceneSnapshot;

/// The shadow rays of a batch of hits, cast at once.
class Visibility {
public:
    /// Whether a model's colour depends on more than the point that it shades.
    static bool is_needed_by(const Shading& shading);

    /// The model of a hit, with its lights, and the normal with which it shades.
    using ShadingAt = std::function<std::pair<const Shading*, glm::dvec3>(const Hit&, const Ray&)>;

    /// Casts shadow rays from all hits of a batch; misses are left out, and so is light that does not reach the shaded
    /// side. `absorption` is nothing if all surfaces are opaque. The directions of pixels differ over blocks of 4 x 4
    /// pixels, of which each is `step` pixels from the next.
    Visibility(const SceneSnapshot& scene, RayBatch& batch, const ShadingAt& shading_at,
               const std::optional<Absorption>& absorption, ShadowRays kind = ShadowRays::by_weight, int step = 1);
    /// All lights and the sky are visible.
    Visibility() = default;

    /// The parts of a SurfacePoint for the i-th hit. If rays begin at random, only the sum of the colours along a ray
    /// is right on average, and a part may be above 1.
    std::span<const double> lit(std::size_t i) const;
    double openness(std::size_t i) const;

private:
    struct Range {
        std::size_t first = 0, count = 0;
    };
    std::vector<double> from_lights_; ///< the parts of light that arrive
    std::vector<Range> to_lights_;    ///< the places of each hit in these
    std::vector<double> from_sky_;    ///< by hit
};

} // namespace isospline
