// The illumination models as one closed set.
#pragma once

#include "isospline/shade/outline.h"
#include "isospline/shade/phong.h"

#include <variant>

namespace isospline {

using Shading = std::variant<Phong, Outline>;

inline void validate(const Shading& shading)
{
    std::visit([](const auto& model) { validate(model); }, shading);
}

inline glm::dvec3 shade(const Shading& shading, const SurfacePoint& point)
{
    return std::visit([&](const auto& model) { return shade(model, point); }, shading);
}

} // namespace isospline
