// Random points of an isosurface and its caps, uniform by area.
#pragma once

#include "isospline/shell/isosurface.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace isospline {

struct SurfaceSample {
    glm::dvec3 position{0.0}; ///< world space, on the surface or a cap
    glm::dvec3 normal{0.0};   ///< unit, outward
    std::uint64_t primitive_id = 0;
};

/// Fills in the samples of a surface, starting at number `first`; sample i depends on i and the seed alone.
///
/// Rejection sampling: a line along a random axis through a random cell of the shell meets the surface with a known
/// density, and each point is kept with a probability that makes the density uniform. If the surface is capped, points
/// of the planes are tried with the same density, and kept if they are in the solid. The result is exact, and the area
/// of the curved surface is not needed. Throws std::invalid_argument if the surface has no points. This is assumed
/// after a million lines without one.
void sample_surface(const IsosurfaceSnapshot& surface, std::uint32_t seed, std::size_t first,
                    std::span<SurfaceSample> samples);

} // namespace isospline
