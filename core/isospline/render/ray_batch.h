// The hits of camera rays, through translucent surfaces.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/scene/absorption.h"
#include "isospline/trace/hit.h"

#include <glm/vec2.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace isospline {

class RayCaster;
class SceneSnapshot;

/// The rays of some samples of some pixels, all of a pixel one after the other, and their first hits.
///
/// Hits behind translucent surfaces follow after all first hits, ray by ray and from front to back, each with its ray.
struct RayBatch {
    std::vector<glm::ivec2> pixels;     ///< of each ray
    std::vector<std::uint32_t> samples; ///< of each ray: the numbers
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    std::vector<std::size_t> behind; ///< hits behind that of ray i: from behind[i] to behind[i + 1]; none if empty
    std::vector<double> weights;     ///< of each hit in the colour of its ray; all are 1 if empty

    /// Begins a batch of `sample_count` rays for each pixel, of the samples from a first one on.
    void begin(std::span<const glm::ivec2> of_pixels, std::size_t first_sample, std::size_t sample_count);
    /// Leaves only the first hits.
    void drop_behind();
    /// The origin for a ray that leaves hit i in a direction: SceneSnapshot::offset_position(), found once for each
    /// side of the surface.
    glm::dvec3 origin(const SceneSnapshot& scene, std::size_t i, const glm::dvec3& towards);

private:
    std::vector<std::array<std::optional<glm::dvec3>, 2>> origins_; ///< of each hit, inside and outside
};

/// Finds the hits of a batch's rays, as long as at least Absorption::least_visible of the light is left. Surfaces of
/// opacity 0 are ignored.
void find_hits_through(RayBatch& batch, RayCaster& caster, const Absorption& absorption, const OpacityOf& opacity_of);

} // namespace isospline
