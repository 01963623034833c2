#include "isospline/scene/absorption.h"

#include "isospline/scene/scene_snapshot.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace isospline {

namespace {

/// Of a depth that halves the light.
constexpr double halving = 0x1p40;

constexpr double least_transmittance = 0.01;

/// That of opaque surfaces: larger than any other.
constexpr Absorption::Depth opaque = Absorption::Depth{1} << 46;

Absorption::Depth depth_of(double opacity)
{
    return opacity < 1.0 ? std::llround(-halving * std::log2(1.0 - opacity)) : opaque;
}

} // namespace

const Absorption::Depth Absorption::darkness = std::llround(-halving * std::log2(least_transmittance));
// The factor is more than the rounding of a sum of depths.
const Absorption::Depth Absorption::invisibility = std::llround(-halving * std::log2(0.999 * least_visible));

Absorption::Absorption(const SceneSnapshot& scene,
                       const std::function<std::optional<double>(std::uint32_t)>& even_opacity, OpacityOf opacity_of)
    : opacity_of_(std::move(opacity_of))
{
    for (const std::uint32_t id : scene.ids()) {
        const std::optional<double> opacity = even_opacity(id);
        depths_.push_back(opacity ? std::optional(depth_of(*opacity)) : std::nullopt);
    }
}

Absorption::Depth Absorption::depth(const Hit& hit, const Ray& ray) const
{
    return depth_of(opacity_of_(hit, ray));
}

bool Absorption::has_opaque() const
{
    return std::find(depths_.begin(), depths_.end(), opaque) != depths_.end();
}

double Absorption::transmittance(Depth depth)
{
    return depth < darkness ? std::exp2(static_cast<double>(-depth) / halving) : 0.0;
}

Absorption::Depth Absorption::depth_of_part(double part)
{
    if (!(part > least_transmittance))
        return darkness;
    return std::min(darkness, static_cast<Depth>(std::floor(-halving * std::log2(part))) + 1);
}

} // namespace isospline
