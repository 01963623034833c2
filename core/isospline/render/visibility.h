// What hits see: their lights, and the sky, through what is translucent.
#pragma once

#include "isospline/render/ray_batch.h"
#include "isospline/shade/shading.h"
#include "isospline/trace/hit.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace isospline {

class SceneSnapshot;

/// The shadow rays of a batch of hits, cast at once.
class Visibility {
public:
    /// Whether a model's colour depends on more than the point that it shades.
    static bool is_needed_by(const Shading& shading);

    /// Looks from all hits of the rays of some pixels' `sample`; misses are left out. `shading_of` is the model of a
    /// hit, with its lights; unless all of them are opaque, light loses what is absorbed by every surface on its way.
    Visibility(const SceneSnapshot& scene, const RayBatch& batch,
               const std::function<const Shading&(const Hit&)>& shading_of, bool all_opaque, std::uint32_t sample);
    /// Nothing is hidden.
    Visibility() = default;

    /// The parts of a SurfacePoint for the i-th hit.
    std::span<const double> lit(std::size_t i) const;
    double openness(std::size_t i) const;

private:
    struct Range {
        std::size_t first = 0, count = 0;
    };
    std::vector<double> transmittances_;    ///< of all shadow rays
    std::vector<Range> to_lights_, to_sky_; ///< shadow rays of each hit
};

} // namespace isospline
