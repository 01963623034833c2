// Random points of an isosurface, uniform by area.
#pragma once

#include "isospline/shell/isosurface.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace isospline {

struct SurfaceSample {
    glm::dvec3 position{0.0}; ///< world space, on the surface
    glm::dvec3 normal{0.0};   ///< unit, outward
    std::uint64_t primitive_id = 0;
};

/// Fills in the samples of a surface that begin at number `first`; sample i is a function of i and the seed alone.
///
/// Rejection sampling: a line along a random axis through a random cell of the shell meets the surface with a density
/// that is known at each point, and the point is kept with a probability that evens it out. Exact, and no area is
/// needed. Throws std::invalid_argument where the surface has no point, as far as a million lines for one sample tell.
void sample_surface(const IsosurfaceSnapshot& surface, std::uint32_t seed, std::size_t first,
                    std::span<SurfaceSample> samples);

} // namespace isospline
