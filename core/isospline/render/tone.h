// Tone mapping: maps light of any brightness to the range of displays.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>

namespace isospline {

enum class ToneCurve {
    neutral, ///< Khronos PBR neutral, as in its specification (2024): it keeps hues and colours of surfaces
    aces,    ///< K. Narkowicz, "ACES filmic tone mapping curve", 2016
    linear   ///< clips at 1
};

/// A linear colour after Khronos' curve.
inline glm::dvec3 neutral_tone(glm::dvec3 color)
{
    constexpr double begin = 0.8 - 0.04, desaturation = 0.15, span = 1.0 - begin;
    const double least = std::min({color.x, color.y, color.z});
    color -= least < 0.08 ? least - 6.25 * least * least : 0.04;
    const double peak = std::max({color.x, color.y, color.z});
    if (!(peak >= begin))
        return color;
    const double compressed = 1.0 - span * span / (peak - begin + span);
    const double gray = 1.0 - 1.0 / (desaturation * (peak - compressed) + 1.0);
    return glm::mix(color * (compressed / peak), glm::dvec3(compressed), gray);
}

inline glm::dvec3 tone_mapped(const glm::dvec3& color, ToneCurve curve)
{
    switch (curve) {
    case ToneCurve::neutral:
        return neutral_tone(color);
    case ToneCurve::aces:
        return glm::clamp(color * (2.51 * color + 0.03) / (color * (2.43 * color + 0.59) + 0.14), 0.0, 1.0);
    case ToneCurve::linear:
        break;
    }
    return glm::min(color, glm::dvec3(1.0));
}

} // namespace isospline
