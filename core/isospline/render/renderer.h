// Rendering of pictures.
#pragma once

#include "isospline/render/camera.h"
#include "isospline/render/image.h"
#include "isospline/render/pixel_samples.h"
#include "isospline/render/tone.h"
#include "isospline/shade/shading.h"
#include "isospline/util/progress.h"

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace isospline {

class Projection;
class SceneSnapshot;

/// Where the shadow rays of a camera ray through translucent surfaces begin.
enum class ShadowRays {
    by_weight, ///< at each surface, by its weight in the colour; they transmit parts of the light
    at_random  ///< at one of the surfaces; they transmit all or nothing. For means over neighbouring pixels.
};

/// The shadings of a scene's objects.
struct Look {
    Shading shading = Phong{};
    std::map<std::uint32_t, Shading> shading_of_geometry; ///< by geometry id, instead of `shading`
};

struct RenderOptions : Look {
    glm::ivec2 size{640, 360};     ///< width and height in pixels; the default is the paper's
    std::optional<Window> crop;    ///< the part of the picture that is rendered; by default all
    glm::vec4 background{0.0f};    ///< linear colour and opacity, not premultiplied, of the background
    int samples = 1;               ///< rays per pixel for its colour
    Layers layers;                 ///< all except those of path traced images
    std::optional<ToneCurve> tone; ///< maps what surfaces add to a pixel
    ColorEncoding encoding = ColorEncoding::linear;
    /// One number for each pixel of the rendered window, 0 for those that stay as they are; without numbers, none does.
    std::vector<std::uint8_t> mask;
    /// Only pixels whose columns and rows in the whole picture are multiples of this are rendered.
    int step = 1;
    ShadowRays shadow_rays = ShadowRays::by_weight;
    double gain_of_further_passes = 0.0; ///< about what settled indexes save other passes, a pixel (SettlingGain)
    bool positions_from_eye = false; ///< whether Image::position is relative to the eye: precise far from the origin
};

/// The first hits of a picture's rays: all samples of a pixel one after the other, pixels row by row. The nearest
/// fragments of a scene's parts give the picture of the scene.
struct Fragments {
    Fragments() = default;
    /// Misses of all samples of some pixels.
    Fragments(std::span<const PixelSample> samples, std::size_t pixel_count);

    void set_hit(std::size_t place, const Hit& hit);

    std::vector<double> weights; ///< of each sample in the colour of a pixel
    std::vector<double> t;       ///< infinite on a miss
    std::vector<std::uint32_t> geometry_ids;
    std::vector<std::uint64_t> primitive_ids;
    std::vector<glm::dvec3> colors; ///< linear; zero where the sample has no weight
};

/// The window of a picture that is rendered. Throws std::invalid_argument for a crop that is empty or extends beyond
/// the picture.
Window rendered_window(const std::optional<Window>& crop, const glm::ivec2& size);

/// Throws std::invalid_argument for numbers that are negative or not finite, and for an opacity above 1.
void validate_background(const glm::vec4& background);

/// Throws std::invalid_argument for a number of rays outside of 1 to 65536.
void validate(const Layers& layers);

/// Throws std::invalid_argument for a bad background, and for layers that render() does not have, or render_part() if
/// it is for a part of a scene.
void validate(const RenderOptions& options, bool is_part);

/// Throws std::invalid_argument for what render_again() refuses.
void validate_again(const RenderOptions& options, std::size_t look_count, std::span<Image* const> images);

/// About what settled indexes save a picture, for Scene::snapshot().
std::uint64_t settling_gain(const RenderOptions& options, std::span<const Look> further = {});

/// A window of an image in which all rays missed.
Image blank_image(const Projection& projection, const Window& window, const Layers& layers = {},
                  ColorEncoding encoding = ColorEncoding::linear);

/// Sets those layers of a pixel that depend on its hit alone.
void set_layers(Image& image, std::size_t pixel, const Layers& layers, const Hit& hit, const SurfacePoint& point,
                const Shading& shading, const glm::dvec3& position_origin);

/// Renders a snapshot of a scene in parallel tiles; the image is the same for any number of threads, bit for
/// bit.
///
/// Colour is the mean over the samples of a pixel, over the background. Alpha is the part of the pixel that surfaces
/// cover, or 1 with an opaque background. The surfaces along a ray, from front to back up to the first opaque one, are
/// composited by the over operator. Light is attenuated by translucent surfaces on its way to a point. Layers come from
/// the ray through the pixel's centre, and show the first surface whose opacity is not 0. The pixels of a crop are
/// those of the whole picture, bit for bit. Throws std::invalid_argument for bad options, and Cancelled if `progress`
/// returns false.
Image render(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options,
             const Progress& progress = {});

/// The same, and pictures in further looks, with the same opacities, from the same rays; these have no layers.
std::vector<Image> render_looks(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options,
                                std::span<const Look> further, const Progress& progress = {});

/// Renders the pixels of a mask again, into images of the window, one for each look. Their layers and counts of covered
/// pixels stay. Also throws std::invalid_argument for options with layers.
void render_again(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options,
                  std::span<const Look> further, std::span<Image* const> images, const Progress& progress = {});

/// Like render(), for a part of a larger scene, with the fragments from which the picture of the larger scene is
/// composed. Also throws std::invalid_argument for shadings whose colours depend on more than the first hit of a ray:
/// those that are not opaque, that cast shadow rays, or whose limits of depth are fitted to the scene.
Image render_part(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options, Fragments& fragments,
                  const Progress& progress = {});

} // namespace isospline
