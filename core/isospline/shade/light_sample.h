// Sampling of lights with an extent, for path tracing.
#pragma once

#include <glm/vec3.hpp>

namespace isospline {

/// A direction to a light, drawn at random.
struct LightSample {
    glm::dvec3 direction{0.0}; ///< unit
    double distance = 0.0;     ///< of the light along it, world units
    glm::dvec3 weight{0.0};    ///< radiance divided by the density
    double density = 0.0;      ///< by solid angle; 0 for a light that other rays cannot meet
};

/// The light that a ray meets.
struct Emission {
    double t = 0.0; ///< along a ray of unit direction
    glm::dvec3 radiance{0.0};
    double density = 0.0; ///< the density of sample() for this direction, by solid angle
};

} // namespace isospline
