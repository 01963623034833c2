// The hits of camera rays, through translucent surfaces.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/scene/absorption.h"
#include "isospline/trace/hit.h"

#include <glm/vec2.hpp>

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace isospline {

class RayCaster;
class SceneSnapshot;

/// One ray through each of some pixels, and its first hit.
///
/// Hits behind translucent surfaces follow after all first hits, ray by ray and from front to back, each with its ray
/// and its pixel.
struct RayBatch {
    std::vector<glm::ivec2> pixels;
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    std::vector<std::size_t> behind; ///< hits behind that of ray i: from behind[i] to behind[i + 1]; none if empty
    std::vector<double> weights;     ///< of each hit in the colour of its ray; all are 1 if empty

    /// Reduces the batch to one ray for each of the first `count` pixels.
    void resize(std::size_t count);
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
