// Ambient occlusion: how open the surroundings of a point are.
#pragma once

#include "isospline/shade/color.h"
#include "isospline/shade/surface_point.h"

#include <glm/vec3.hpp>

#include <limits>

namespace isospline {

/// I = color / pi * integral over the hemisphere about N of V(w) <N, w> dw, with V(w) = 0 where a ray in direction w
/// meets anything within the distance, else 1: the light that a sky of one brightness gives. N is turned to the viewer.
/// Of what is translucent, V is the part that gets through.
struct AmbientOcclusion {
    int samples = 16;                                          ///< rays a hit
    double distance = std::numeric_limits<double>::infinity(); ///< of what can still cover the sky, world units
    Color color = glm::dvec3(1.0);                             ///< of the surface
    double opacity = 1.0; ///< of the surface, 0 to 1; below 1 what is behind it shows through
    CapColor cap_color{}; ///< of capped cuts
};

/// Throws std::invalid_argument for a number of samples outside of 1 to 65536, a distance that is not positive, a
/// colour that is negative or not finite, and an opacity outside of 0 to 1.
void validate(const AmbientOcclusion& occlusion);

/// The surface's colour without light.
glm::dvec3 albedo(const AmbientOcclusion& occlusion, const SurfacePoint& point);

/// The linear colour of a point.
glm::dvec3 shade(const AmbientOcclusion& occlusion, const SurfacePoint& point);

} // namespace isospline
