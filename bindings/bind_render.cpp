#include "arrays.h"
#include "bind.h"
#include "cameras.h"
#include "colors.h"
#include "layers.h"
#include "long_call.h"
#include "looks.h"

#include "isospline/render/renderer.h"
#include "isospline/scene/scene.h"

#include <pybind11/numpy.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

using ShadingOfGeometry = std::map<std::uint32_t, Shading>;
using GivenShading = std::variant<Shading, ShadingOfGeometry>;
/// Whether each pixel is rendered, (height, width).
using Mask = py::array_t<bool, py::array::c_style | py::array::forcecast>;

Look as_look(GivenShading shading)
{
    Look look;
    if (auto* by_geometry = std::get_if<ShadingOfGeometry>(&shading))
        look.shading_of_geometry = std::move(*by_geometry);
    else
        look.shading = std::get<Shading>(std::move(shading));
    return look;
}

/// The options of a picture. Those of its look are left at their defaults.
RenderOptions as_options(std::array<int, 2> size, const py::object& background, int samples, const py::object& layers,
                         int ambient_occlusion_samples, const std::string& encoding, const Crop& crop)
{
    RenderOptions options;
    options.size = {size[0], size[1]};
    options.crop = as_window(crop);
    options.background = as_background(background, "background");
    options.samples = samples;
    options.layers = as_layers(layers, ambient_occlusion_samples);
    options.encoding = as_enum(color_encodings, encoding, "encoding");
    return options;
}

/// Calls `make(snapshot, progress)` with a snapshot for the rays of some pictures.
template <typename Make>
void with_snapshot(Scene& scene, const RenderOptions& options, std::span<const Look> further,
                   const py::object& progress, const Make& make)
{
    long_call("to render " + size_text(options.size.x, options.size.y), progress, [&](const Progress& report) {
        const auto snapshot = scene.snapshot(part_of(report, 0.0, 0.1), settling_gain(options, further));
        make(*snapshot, part_of(report, 0.1, 1.0));
    });
}

std::unique_ptr<Image> render_scene(Scene& scene, const Camera& camera, std::array<int, 2> size, GivenShading shading,
                                    const py::object& background, int samples, const py::object& layers,
                                    int ambient_occlusion_samples, const std::string& encoding, const Crop& crop,
                                    const py::object& progress, const std::optional<std::string>& tone)
{
    RenderOptions options = as_options(size, background, samples, layers, ambient_occlusion_samples, encoding, crop);
    if (tone)
        options.tone = as_enum(tone_curves, *tone, "tone");
    static_cast<Look&>(options) = as_look(std::move(shading));
    auto image = std::make_unique<Image>();
    with_snapshot(scene, options, {}, progress, [&](const SceneSnapshot& snapshot, const Progress& report) {
        *image = render(snapshot, camera, options, report);
    });
    return image;
}

/// The options of a picture in the first of several looks, and the further ones.
std::pair<RenderOptions, std::vector<Look>> as_looks(RenderOptions options, std::vector<GivenShading> shadings)
{
    options.shadow_rays = ShadowRays::at_random;
    if (shadings.empty())
        throw_invalid("shadings", "at least one", 0);
    std::vector<Look> looks;
    for (GivenShading& shading : shadings)
        looks.push_back(as_look(std::move(shading)));
    static_cast<Look&>(options) = std::move(looks.front());
    looks.erase(looks.begin());
    return {std::move(options), std::move(looks)};
}

/// What settled indexes save the passes that follow in a studio, a pixel (SettlingGain).
constexpr double gain_of_soft_light = 40.0;

/// The linear images of a scene over no background in several looks; the first one has layers. Their light is a mean
/// over neighbouring pixels: seen_parts().
std::vector<std::unique_ptr<Image>> render_scene_in_looks(Scene& scene, const Camera& camera, std::array<int, 2> size,
                                                          std::vector<GivenShading> shadings, int samples,
                                                          const py::object& layers, int ambient_occlusion_samples,
                                                          const Crop& crop, const py::object& progress,
                                                          bool positions_from_eye)
{
    RenderOptions given = as_options(size, py::none(), samples, layers, ambient_occlusion_samples, "linear", crop);
    given.positions_from_eye = positions_from_eye;
    given.gain_of_further_passes = gain_of_soft_light;
    const auto [options, further] = as_looks(std::move(given), std::move(shadings));
    std::vector<std::unique_ptr<Image>> images;
    with_snapshot(scene, options, further, progress, [&](const SceneSnapshot& snapshot, const Progress& report) {
        for (Image& image : render_looks(snapshot, camera, options, further, report))
            images.push_back(std::make_unique<Image>(std::move(image)));
    });
    return images;
}

/// Renders some pixels of such images again.
void render_scene_again(Scene& scene, const Camera& camera, std::array<int, 2> size, std::vector<GivenShading> shadings,
                        const std::vector<Image*>& images, int samples, const Mask& mask, int step, const Crop& crop,
                        const py::object& progress)
{
    RenderOptions given = as_options(size, py::none(), samples, py::tuple(), 1, "linear", crop);
    const glm::ivec2 window = rendered_window(given.crop, given.size).size;
    if (mask.ndim() != 2 || glm::ivec2(mask.shape(1), mask.shape(0)) != window)
        throw_invalid("mask", "a bool for each pixel of the window, (height, width)", mask.size());
    given.mask.assign(mask.data(), mask.data() + mask.size());
    given.step = step;
    const auto [options, further] = as_looks(std::move(given), std::move(shadings));
    with_snapshot(scene, options, further, progress, [&](const SceneSnapshot& snapshot, const Progress& report) {
        render_again(snapshot, camera, options, further, images, report);
    });
}

/// A new array with the numbers of a vector, (samples, pixels, ...).
template <typename Number, typename Item>
py::array_t<Number> array_of(const std::vector<Item>& items, std::size_t samples)
{
    Shape shape{static_cast<py::ssize_t>(samples), static_cast<py::ssize_t>(items.size() / samples)};
    if constexpr (sizeof(Item) > sizeof(Number))
        shape.push_back(sizeof(Item) / sizeof(Number));
    auto array = new_array<Number>(shape);
    std::copy_n(reinterpret_cast<const Number*>(items.data()), array.size(), array.mutable_data());
    return array;
}

/// The image of a part of a scene, and a dictionary of its fragments.
py::tuple render_part_of_scene(Scene& scene, const Camera& camera, std::array<int, 2> size, GivenShading shading,
                               const py::object& background, int samples, const py::object& layers,
                               int ambient_occlusion_samples, const std::string& encoding, const Crop& crop,
                               const py::object& progress)
{
    RenderOptions options = as_options(size, background, samples, layers, ambient_occlusion_samples, encoding, crop);
    static_cast<Look&>(options) = as_look(std::move(shading));
    Fragments fragments;
    auto image = std::make_unique<Image>();
    with_snapshot(scene, options, {}, progress, [&](const SceneSnapshot& snapshot, const Progress& report) {
        *image = render_part(snapshot, camera, options, fragments, report);
    });
    const std::size_t count = fragments.weights.size();
    py::dict arrays;
    arrays["weights"] = fragments.weights;
    arrays["t"] = array_of<double>(fragments.t, count);
    arrays["geometry_ids"] = array_of<std::uint32_t>(fragments.geometry_ids, count);
    arrays["primitive_ids"] = array_of<std::uint64_t>(fragments.primitive_ids, count);
    arrays["colors"] = array_of<double>(fragments.colors, count);
    return py::make_tuple(std::move(image), arrays);
}

} // namespace

void bind_render(py::module_& module)
{
    module.def(
        "background_color",
        [](const py::object& background) {
            const glm::vec4 color = as_background(background, "background");
            validate_background(color);
            return std::array<float, 4>{color.r, color.g, color.b, color.a};
        },
        py::arg("background"));
    module.def("render", &render_scene, py::arg("scene"), py::arg("camera"), py::kw_only(), py::arg("size"),
               py::arg("shading"), py::arg("background"), py::arg("samples"), py::arg("layers"),
               py::arg("ambient_occlusion_samples"), py::arg("encoding"), py::arg("crop"), py::arg("progress"),
               py::arg("tone") = py::none());
    module.def("render_looks", &render_scene_in_looks, py::arg("scene"), py::arg("camera"), py::kw_only(),
               py::arg("size"), py::arg("shadings"), py::arg("samples"), py::arg("layers"),
               py::arg("ambient_occlusion_samples"), py::arg("crop"), py::arg("progress"),
               py::arg("positions_from_eye") = false);
    module.def("render_again", &render_scene_again, py::arg("scene"), py::arg("camera"), py::kw_only(), py::arg("size"),
               py::arg("shadings"), py::arg("images"), py::arg("samples"), py::arg("mask"), py::arg("step"),
               py::arg("crop"), py::arg("progress"));
    module.def("render_part", &render_part_of_scene, py::arg("scene"), py::arg("camera"), py::kw_only(),
               py::arg("size"), py::arg("shading"), py::arg("background"), py::arg("samples"), py::arg("layers"),
               py::arg("ambient_occlusion_samples"), py::arg("encoding"), py::arg("crop"), py::arg("progress"));
}

} // namespace isospline
