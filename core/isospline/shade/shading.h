// The illumination models as one closed set.
#pragma once

#include "isospline/shade/ambient_occlusion.h"
#include "isospline/shade/outline.h"
#include "isospline/shade/phong.h"

#include <variant>

namespace isospline {

using Shading = std::variant<Phong, Outline, AmbientOcclusion>;

inline void validate(const Shading& shading)
{
    std::visit([](const auto& model) { validate(model); }, shading);
}

inline glm::dvec3 shade(const Shading& shading, const SurfacePoint& point)
{
    return std::visit([&](const auto& model) { return shade(model, point); }, shading);
}

inline double opacity(const Shading& shading)
{
    return std::visit([](const auto& model) { return model.opacity; }, shading);
}

/// Whether the colour of a point follows from its curvature.
bool needs_curvature(const Shading& shading);

/// Puts limits into the colours by depth that are to fit to the scene.
void fit_depth_limits(Shading& shading, const DepthRange& depths);

inline glm::dvec3 albedo(const Shading& shading, const SurfacePoint& point)
{
    return std::visit([&](const auto& model) { return albedo(model, point); }, shading);
}

} // namespace isospline
