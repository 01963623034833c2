// The opacity of a surface, and its increase towards the silhouette.
#pragma once

#include "isospline/util/check.h"

#include <optional>

namespace isospline {

/// opacity + (silhouette_opacity - opacity) (1 - |<N, V>|)^silhouette_exponent, for the unit normal N and the unit
/// direction V against the ray: thin walls are more opaque to oblique rays (D. S. Kay, D. Greenberg,
/// "Transparency for computer synthesized images", SIGGRAPH 1979, whose transparency is 1 less this). It is the same
/// for both signs of the normal.
double opacity_at(double opacity, double silhouette_opacity, double silhouette_exponent, double n_v);

/// Whether the opacity of a model is the same for all directions.
template <typename Model>
bool has_even_opacity(const Model& model)
{
    return !model.silhouette_opacity || *model.silhouette_opacity == model.opacity;
}

/// The opacity of a model at a cosine <N, V>.
template <typename Model>
double opacity(const Model& model, double n_v)
{
    return has_even_opacity(model)
               ? model.opacity
               : opacity_at(model.opacity, *model.silhouette_opacity, model.silhouette_exponent, n_v);
}

/// Throws std::invalid_argument for opacities outside of 0 to 1 and an exponent that is not positive.
template <typename Model>
void validate_opacity(const Model& model)
{
    check_fraction("opacity", model.opacity);
    if (model.silhouette_opacity)
        check_fraction("silhouette_opacity", *model.silhouette_opacity);
    check_positive("silhouette_exponent", model.silhouette_exponent);
}

} // namespace isospline
