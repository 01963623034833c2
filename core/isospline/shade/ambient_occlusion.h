// Ambient occlusion: the openness of the surroundings of a point.
#pragma once

#include "isospline/shade/color.h"
#include "isospline/shade/surface_point.h"
#include "isospline/util/value_class.h"

#include <glm/vec3.hpp>

#include <limits>
#include <optional>
#include <tuple>

namespace isospline {

/// I = color / pi * integral over the hemisphere about N of V(w) <N, w> dw, with V(w) = 0 if a ray in direction w
/// meets anything within the distance, otherwise 1: the light of a uniform sky. N is flipped to face the viewer. For
/// translucent surfaces, V is the transmitted fraction.
struct AmbientOcclusion {
    int samples = 16; ///< rays per hit
    double distance =
        std::numeric_limits<double>::infinity(); ///< the largest distance of surfaces that cover the sky, world units
    Color color = glm::dvec3(1.0);               ///< of the surface
    double opacity = 1.0;                        ///< of the surface, 0 to 1; below 1, the background shows through
    std::optional<double> silhouette_opacity{};  ///< the opacity at the silhouette, see opacity_at(); nothing: the same
    double silhouette_exponent = 3.0;            ///< the larger, the thinner the silhouette
    CapColor cap_color{};                        ///< of capped cuts
};

template <>
struct ValueClass<AmbientOcclusion> {
    static constexpr char name[] = "AmbientOcclusion";
    static constexpr std::tuple parameters{Parameter{"samples", &AmbientOcclusion::samples},
                                           Parameter{"distance", &AmbientOcclusion::distance},
                                           Parameter{"color", &AmbientOcclusion::color},
                                           Parameter{"opacity", &AmbientOcclusion::opacity},
                                           Parameter{"silhouette_opacity", &AmbientOcclusion::silhouette_opacity},
                                           Parameter{"silhouette_exponent", &AmbientOcclusion::silhouette_exponent},
                                           Parameter{"cap_color", &AmbientOcclusion::cap_color}};
};

/// Throws std::invalid_argument for a number of samples outside of 1 to 65536, a distance that is not positive, a
/// colour that is negative or not finite, and as validate_opacity() does.
void validate(const AmbientOcclusion& occlusion);

/// The surface's colour without light.
glm::dvec3 albedo(const AmbientOcclusion& occlusion, const SurfacePoint& point);

/// The linear colour of a point.
glm::dvec3 shade(const AmbientOcclusion& occlusion, const SurfacePoint& point);

} // namespace isospline
