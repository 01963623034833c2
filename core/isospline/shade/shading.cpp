#include "isospline/shade/shading.h"

#include <tuple>
#include <type_traits>

namespace isospline {

namespace {

/// Calls `visit` with each colour among the parameters of a model; const if the model is.
template <typename Model, typename Visit>
void for_each_color(Model& model, const Visit& visit)
{
    const auto look_at = [&](auto& member) {
        using Member = std::remove_cvref_t<decltype(member)>;
        if constexpr (std::is_same_v<Member, Color>)
            visit(member);
        else if constexpr (std::is_same_v<Member, CapColor>)
            if (member)
                visit(*member);
    };
    std::apply([&](const auto&... parameter) { (look_at(model.*parameter.member), ...); },
               ValueClass<std::remove_const_t<Model>>::parameters);
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
