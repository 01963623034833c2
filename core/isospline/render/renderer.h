// Pictures of what rays find.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/render/camera.h"
#include "isospline/render/image.h"
#include "isospline/shade/shading.h"
#include "isospline/trace/hit.h"
#include "isospline/util/progress.h"

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <functional>
#include <map>
#include <span>

namespace isospline {

class SceneSnapshot;

struct RenderOptions {
    glm::ivec2 size{640, 360}; ///< width and height in pixels; the default is the paper's
    Shading shading = Phong{};
    std::map<std::uint32_t, Shading> shading_of_geometry; ///< by geometry id, instead of `shading`
    glm::vec4 background{0.0f}; ///< linear colour and opacity, not premultiplied, of what shows where no surface is
    int samples = 1;            ///< rays of a pixel that make its colour
    Layers layers;              ///< all but `direct`
};

/// Throws std::invalid_argument for numbers that are negative or not finite, and for an opacity above 1.
void validate_background(const glm::vec4& background);

/// Throws std::invalid_argument for a number of rays outside of 0 to 65536.
void validate(const Layers& layers);

/// Finds the first hit of each ray; called from many threads at once.
using CastRays = std::function<void(std::span<const Ray> rays, std::span<Hit> hits)>;

/// Completes what is shaded at a hit, of which position, normal, depth and direction to the viewer are given; called
/// from many threads at once.
using CompletePoint = std::function<void(SurfacePoint& point, const Hit& hit, bool with_curvature)>;

/// Renders what `cast_rays` finds, in parallel tiles; the image is the same for any number of threads, bit for bit.
///
/// Colour is the mean over the samples of a pixel, over the background; its alpha is the part of the pixel that
/// surfaces cover, raised by an opaque background to 1. All the rest comes from the ray through the pixel's centre.
/// Throws std::invalid_argument for bad options, and Cancelled where `progress` returns false. Shadows, ambient
/// occlusion and opacities below 1, which need more than first hits, are bad options here.
Image render(const CastRays& cast_rays, const Camera& camera, const RenderOptions& options,
             const Progress& progress = {}, const CompletePoint& complete_point = {});

/// Renders a scene as it is in a snapshot. What a ray meets from front to back, up to the first opaque surface, is
/// composited by the over operator; the rest of the image is of the first surface whose opacity is not 0. Light is
/// attenuated by the surfaces that it goes through on its way to a point.
Image render(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options,
             const Progress& progress = {});

} // namespace isospline
