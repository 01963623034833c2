// The layers, encodings and tone curves of images, by their Python names.
#pragma once

#include "arrays.h"

#include "isospline/render/image.h"
#include "isospline/render/tone.h"

#include <array>
#include <optional>

namespace isospline {

inline constexpr Named<bool Layers::*> layer_names[] = {
    {"depth", &Layers::depth},
    {"position", &Layers::position},
    {"normal", &Layers::normal},
    {"albedo", &Layers::albedo},
    {"gradient_magnitude", &Layers::gradient_magnitude},
    {"curvature", &Layers::curvature},
    {"ambient_occlusion", &Layers::ambient_occlusion},
    {"direct", &Layers::direct},
    {"variance", &Layers::variance},
    {"geometry_ids", &Layers::geometry_ids},
    {"primitive_ids", &Layers::primitive_ids},
    {"certified", &Layers::certified},
};

inline const EnumWords<ColorEncoding> color_encodings{{"linear", ColorEncoding::linear},
                                                      {"srgb8", ColorEncoding::srgb8}};

inline const EnumWords<ToneCurve> tone_curves{
    {"neutral", ToneCurve::neutral}, {"aces", ToneCurve::aces}, {"linear", ToneCurve::linear}};

/// First column and row, width and height; nothing means the whole picture.
using Crop = std::optional<std::array<int, 4>>;

inline std::optional<Window> as_window(const Crop& crop)
{
    return crop ? std::optional(Window{{(*crop)[0], (*crop)[1]}, {(*crop)[2], (*crop)[3]}}) : std::nullopt;
}

inline Layers as_layers(const pybind11::handle& names, int ambient_occlusion_samples)
{
    Layers layers = as_flags<Layers>(layer_names, names, "layers");
    layers.ambient_occlusion_samples = ambient_occlusion_samples;
    return layers;
}

} // namespace isospline
