#include "isospline/shade/shading.h"

#include <array>
#include <type_traits>

namespace isospline {

namespace {

/// The colours of a model, const if that is.
template <typename Model>
auto colors_of(Model& model)
{
    if constexpr (std::is_same_v<std::remove_const_t<Model>, Outline>)
        return std::array{&model.color, &model.surface_color};
    else
        return std::array{&model.color};
}

} // namespace

bool needs_curvature(const Shading& shading)
{
    const auto needed = [](const auto& model) {
        for (const Color* color : colors_of(model))
            if (std::holds_alternative<ColorByCurvature>(*color))
                return true;
        return false;
    };
    return std::visit(needed, shading);
}

void fit_depth_limits(Shading& shading, const glm::dvec2& limits)
{
    const auto fit = [&](auto& model) {
        for (Color* color : colors_of(model))
            if (auto* by_depth = std::get_if<ColorByDepth>(color); by_depth && by_depth->fit_limits)
                by_depth->map.limits = limits;
    };
    std::visit(fit, shading);
}

} // namespace isospline
