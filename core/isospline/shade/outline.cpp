#include "isospline/shade/outline.h"

#include "isospline/math/power-inl.h"
#include "isospline/shade/opacity.h"
#include "isospline/util/check.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>

namespace isospline {

void validate(const Outline& outline)
{
    check_not_negative("exponent", outline.exponent);
    validate("color", outline.color);
    validate("surface_color", outline.surface_color);
    validate_opacity(outline);
    if (outline.cap_color)
        validate("cap_color", *outline.cap_color);
}

glm::dvec3 albedo(const Outline& outline, const SurfacePoint& point)
{
    return color_at(outline.surface_color, outline.cap_color, point) * point.vertex_color;
}

glm::dvec3 shade(const Outline& outline, const SurfacePoint& point)
{
    const double n_v = glm::dot(point.normal, point.to_viewer);
    // Rounding may take a product of unit vectors past 1.
    const double intensity = scalar::power(std::max(1.0 - n_v * n_v, 0.0), outline.exponent);
    return glm::mix(albedo(outline, point), color_at(outline.color, point), intensity);
}

} // namespace isospline
