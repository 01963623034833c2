// The paper's outline illumination model (§6).
#pragma once

#include "isospline/shade/color.h"
#include "isospline/shade/surface_point.h"
#include "isospline/util/value_class.h"

#include <glm/vec3.hpp>

#include <optional>
#include <tuple>

namespace isospline {

/// I = (1 - <N, V>^2)^no: bright where the surface turns away from the viewer. It needs no light, and it is the same
/// for both signs of the normal.
///
/// I goes from the surface's colour (0) to the colour of the lines (1); with black and white it is the paper's form.
struct Outline {
    double exponent = 2.0;                      ///< no
    Color color = glm::dvec3(1.0);              ///< of the lines
    Color surface_color = glm::dvec3(0.0);      ///< of the surface between the lines
    double opacity = 1.0;                       ///< of both, 0 to 1; below 1, the background shows through
    std::optional<double> silhouette_opacity{}; ///< the opacity at the silhouette, see opacity_at(); nothing: the same
    double silhouette_exponent = 3.0;           ///< the larger, the thinner the silhouette
    CapColor cap_color{};                       ///< of capped cuts, instead of surface_color
};

template <>
struct ValueClass<Outline> {
    static constexpr char name[] = "Outline";
    static constexpr std::tuple parameters{Parameter{"exponent", &Outline::exponent},
                                           Parameter{"color", &Outline::color},
                                           Parameter{"surface_color", &Outline::surface_color},
                                           Parameter{"opacity", &Outline::opacity},
                                           Parameter{"silhouette_opacity", &Outline::silhouette_opacity},
                                           Parameter{"silhouette_exponent", &Outline::silhouette_exponent},
                                           Parameter{"cap_color", &Outline::cap_color}};
};

/// Throws std::invalid_argument for numbers that are not finite or negative, and like validate_opacity().
void validate(const Outline& outline);

/// The linear colour of the surface itself, without lines, at a point.
glm::dvec3 albedo(const Outline& outline, const SurfacePoint& point);

/// The linear colour of a point.
glm::dvec3 shade(const Outline& outline, const SurfacePoint& point);

} // namespace isospline
