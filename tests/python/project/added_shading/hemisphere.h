// Hemisphere lighting.
#pragma once

#include "isospline/shade/color.h"
#include "isospline/shade/opacity.h"
#include "isospline/shade/surface_point.h"
#include "isospline/util/check.h"
#include "isospline/util/value_class.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <optional>
#include <tuple>

namespace isospline {

/// I = (1 + <N, U>) / 2: the light of a sky above and of a black ground below.
struct Hemisphere {
    Color color = glm::dvec3(1.0);
    glm::dvec3 up{0.0, 0.0, 1.0}; ///< U, of any length
    double opacity = 1.0;
    std::optional<double> silhouette_opacity{};
    double silhouette_exponent = 3.0;
    CapColor cap_color{};
};

template <>
struct ValueClass<Hemisphere> {
    static constexpr char name[] = "Hemisphere";
    static constexpr std::tuple parameters{Parameter{"color", &Hemisphere::color},
                                           Parameter{"up", &Hemisphere::up},
                                           Parameter{"opacity", &Hemisphere::opacity},
                                           Parameter{"silhouette_opacity", &Hemisphere::silhouette_opacity},
                                           Parameter{"silhouette_exponent", &Hemisphere::silhouette_exponent},
                                           Parameter{"cap_color", &Hemisphere::cap_color}};
};

inline void validate(const Hemisphere& hemisphere)
{
    validate("color", hemisphere.color);
    check_direction("up", hemisphere.up);
    validate_opacity(hemisphere);
    if (hemisphere.cap_color)
        validate("cap_color", *hemisphere.cap_color);
}

inline glm::dvec3 albedo(const Hemisphere& hemisphere, const SurfacePoint& point)
{
    return color_at(hemisphere.color, hemisphere.cap_color, point) * point.vertex_color;
}

inline glm::dvec3 shade(const Hemisphere& hemisphere, const SurfacePoint& point)
{
    return albedo(hemisphere, point) * (0.5 + 0.5 * glm::dot(point.normal, glm::normalize(hemisphere.up)));
}

} // namespace isospline
