#include "isospline/shade/shading.h"

#include <type_traits>

namespace isospline {

namespace {

/// Calls `visit` with each colour of a model; const if the model is.
template <typename Model, typename Visit>
void for_each_color(Model& model, const Visit& visit)
{
    visit(model.color);
    if constexpr (std::is_same_v<std::remove_const_t<Model>, Outline>)
        visit(model.surface_color);
    if (model.cap_color)
        visit(*model.cap_color);
}

} // namespace

bool needs_curvature(const Shading& shading)
{
    bool needed = false;
    const auto look = [&](const Color& color) { needed = needed || needs_curvature(color); };
    std::visit([&](const auto& model) { for_each_color(model, look); }, shading);
    return needed;
}

void fit_depth_limits(Shading& shading, const DepthRange& depths)
{
    const auto fit = [&](Color& color) { fit_depth_limits(color, depths); };
    std::visit([&](auto& model) { for_each_color(model, fit); }, shading);
}

} // namespace isospline
