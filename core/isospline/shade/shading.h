// The illumination models as one closed set.
#pragma once

#include "isospline/shade/ambient_occlusion.h"
#include "isospline/shade/opacity.h"
#include "isospline/shade/outline.h"
#include "isospline/shade/phong.h"

#include <glm/geometric.hpp>

#include <optional>
#include <variant>

namespace isospline {

using Shading = std::variant<Phong, Outline, AmbientOcclusion>;

inline void validate(const Shading& shading)
{
    std::visit([](const auto& model) { validate(model); }, shading);
}

inline glm::dvec3 shade(const Shading& shading, const SurfacePoint& point)
{
    const auto shaded = [&](const auto& model) {
        return is_unlit(model.cap_color, point) ? color_at(*model.cap_color, point) : shade(model, point);
    };
    return std::visit(shaded, shading);
}

/// The opacity, if it is the same from all directions.
inline std::optional<double> even_opacity(const Shading& shading)
{
    return std::visit(
        [](const auto& model) { return has_even_opacity(model) ? std::optional(model.opacity) : std::nullopt; },
        shading);
}

inline double opacity(const Shading& shading, const SurfacePoint& point)
{
    const double n_v = glm::dot(point.normal, point.to_viewer);
    return std::visit([&](const auto& model) { return opacity(model, n_v); }, shading);
}

/// Whether the colour of a point depends on its curvature.
bool needs_curvature(const Shading& shading);

/// Sets the limits of colours by depth that fit the scene.
void fit_depth_limits(Shading& shading, const DepthRange& depths);

inline glm::dvec3 albedo(const Shading& shading, const SurfacePoint& point)
{
    return std::visit([&](const auto& model) { return albedo(model, point); }, shading);
}

} // namespace isospline
