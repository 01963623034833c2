// What hits see: their lights, and the sky.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/shade/shading.h"
#include "isospline/trace/hit.h"

#include <glm/vec2.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace isospline {

class Scene;

/// The shadow rays of a batch of hits, cast at once.
class Visibility {
public:
    /// Whether a model's colour depends on more than the point that it shades.
    static bool is_needed_by(const Shading& shading);

    /// Looks from the hits of the rays of some pixels' `sample`; misses are left out. `shading_of` is the model of a
    /// hit, with its lights.
    Visibility(const Scene& scene, std::span<const Ray> rays, std::span<const Hit> hits,
               const std::function<const Shading&(const Hit&)>& shading_of, std::span<const glm::ivec2> pixels,
               std::uint32_t sample);
    /// Nothing is hidden.
    Visibility() = default;

    /// The parts of a SurfacePoint for the i-th ray.
    std::span<const std::uint8_t> lit(std::size_t i) const;
    double openness(std::size_t i) const;

private:
    struct Range {
        std::size_t first = 0, count = 0;
    };
    std::vector<std::uint8_t> seen_;        ///< of all shadow rays
    std::vector<Range> to_lights_, to_sky_; ///< shadow rays of each hit
};

} // namespace isospline
