// Pictures of what rays find.
#pragma once

#include "isospline/render/camera.h"
#include "isospline/render/image.h"
#include "isospline/shade/shading.h"
#include "isospline/util/progress.h"

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <map>

namespace isospline {

class Projection;
class SceneSnapshot;

struct RenderOptions {
    glm::ivec2 size{640, 360}; ///< width and height in pixels; the default is the paper's
    Shading shading = Phong{};
    std::map<std::uint32_t, Shading> shading_of_geometry; ///< by geometry id, instead of `shading`
    glm::vec4 background{0.0f}; ///< linear colour and opacity, not premultiplied, of what shows where no surface is
    int samples = 1;            ///< rays of a pixel that make its colour
    Layers layers;              ///< all but those of path traced images
    ColorEncoding encoding = ColorEncoding::linear;
};

/// Throws std::invalid_argument for numbers that are negative or not finite, and for an opacity above 1.
void validate_background(const glm::vec4& background);

/// Throws std::invalid_argument for a number of rays outside of 1 to 65536.
void validate(const Layers& layers);

/// An image of a camera whose rays all missed.
Image blank_image(const Projection& projection, const Layers& layers = {},
                  ColorEncoding encoding = ColorEncoding::linear);

/// Renders a scene as it is in a snapshot, in parallel tiles; the image is the same for any number of threads, bit for
/// bit.
///
/// Colour is the mean over the samples of a pixel, over the background; its alpha is the part of the pixel that
/// surfaces cover, raised by an opaque background to 1. What a ray meets from front to back, up to the first opaque
/// surface, is composited by the over operator. Light is attenuated by the surfaces that it goes through on its way to
/// a point. Layers come from the ray through the pixel's centre, and are of the first surface whose opacity is not 0.
/// Throws std::invalid_argument for bad options, and Cancelled where `progress` returns false.
Image render(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options,
             const Progress& progress = {});

} // namespace isospline
