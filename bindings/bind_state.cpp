// The state of volumes, isosurfaces and images for pickle. Large arrays are views of the objects' own memory; protocol
// 5 sends them out of band, without a copy. isospline/base/values.py handles all other types.
#include "arrays.h"
#include "bind.h"
#include "handed.h"
#include "long_call.h"
#include "looks.h"
#include "volume_state.h"

#include "isospline/render/image.h"
#include "isospline/shade/material.h"
#include "isospline/shell/isosurface.h"
#include "isospline/spline/volume.h"
#include "isospline/store/sharded_array.h"

#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

/// A one-dimensional array over memory that `owner` keeps alive.
template <typename Number>
py::array_t<Number> view_of(const Number* first, std::size_t count, const py::object& owner)
{
    return py::array_t<Number>(Shape{static_cast<py::ssize_t>(count)}, first, owner);
}

template <typename Number>
py::array_t<Number, py::array::c_style | py::array::forcecast> array_of(const py::dict& state, const char* name)
{
    return py::array_t<Number, py::array::c_style | py::array::forcecast>(state[name]);
}

// Volumes.

/// The store of a volume whose coefficients are in one: unpickling opens it again.
py::object store_of(const Volume& volume)
{
    const auto* const array = dynamic_cast<const ShardedArray*>(volume.source());
    if (array == nullptr)
        return py::none();
    const std::filesystem::path& folder = array->layout().folder; // the array "coefficients/..." of the store
    const std::filesystem::path store = folder.parent_path().parent_path();
    return py::make_tuple(store.string(), folder.lexically_relative(store).string(), array->memory_limit());
}

py::dict volume_state(const py::object& self)
{
    const auto& volume = self.cast<const Volume&>();
    py::dict state = dict_of(volume.options(), volume.summary());
    if (volume.source() != nullptr) {
        state["store"] = store_of(volume);
        return state;
    }
    const std::span<const float> coefficients = volume.stored_coefficients();
    state["coefficients"] = view_of(coefficients.data(), coefficients.size(), self);
    return state;
}

std::shared_ptr<Volume> volume_of(const py::dict& state)
{
    if (state.contains("store"))
        return handed("reopen")(*py::tuple(state["store"])).cast<std::shared_ptr<Volume>>();
    const VolumeOptions options = options_in(state);
    const VolumeSummary summary = summary_in(state);
    const auto coefficients = array_of<float>(state, "coefficients");
    const std::span<const float> stored(coefficients.data(), static_cast<std::size_t>(coefficients.size()));
    std::shared_ptr<Volume> volume;
    long_call("to copy a volume", py::none(),
              [&](const Progress&) { volume = std::make_shared<Volume>(options, summary, stored); });
    return volume;
}

// Isosurfaces: unpickling builds their index again.

py::dict isosurface_state(const py::object& self)
{
    const auto& surface = self.cast<const Isosurface&>();
    const IsosurfaceOptions& options = surface.options();
    auto clip = new_array<double>(Shape{static_cast<py::ssize_t>(options.clip.size()), 4});
    for (std::size_t i = 0; i < options.clip.size(); ++i) {
        const auto row = static_cast<py::ssize_t>(i);
        for (int axis = 0; axis < 3; ++axis)
            clip.mutable_at(row, axis) = options.clip[i].normal[axis];
        clip.mutable_at(row, 3) = options.clip[i].offset;
    }
    py::dict state;
    state["volume"] = py::cast(std::const_pointer_cast<Volume>(surface.shared_volume()));
    state["level"] = surface.level();
    state["prune_depth"] = options.shell.prune_depth;
    state["prune_border"] = options.shell.prune_border;
    state["mask"] = options.shell.mask.empty()
                        ? py::object(py::none())
                        : py::object(view_of(options.shell.mask.data(), options.shell.mask.size(), self));
    state["largest"] = options.largest;
    state["clip"] = clip;
    state["capped"] = options.capped;
    state["closed"] = options.closed;
    state["method"] = static_cast<int>(options.method);
    state["inside"] = static_cast<int>(options.inside);
    state["material"] = options.material ? std::optional(*options.material) : std::nullopt;
    return state;
}

std::shared_ptr<Isosurface> isosurface_of(const py::dict& state)
{
    IsosurfaceOptions options;
    options.shell.prune_depth = state["prune_depth"].cast<int>();
    options.shell.prune_border = state["prune_border"].cast<bool>();
    if (!state["mask"].is_none()) {
        const auto mask = array_of<std::uint8_t>(state, "mask");
        options.shell.mask.assign(mask.data(), mask.data() + mask.size());
    }
    const auto clip = array_of<double>(state, "clip");
    for (py::ssize_t row = 0; row < clip.shape(0); ++row)
        options.clip.push_back({{clip.at(row, 0), clip.at(row, 1), clip.at(row, 2)}, clip.at(row, 3)});
    options.largest = state["largest"].cast<int>();
    options.capped = state["capped"].cast<bool>();
    options.closed = state["closed"].cast<bool>();
    options.method = static_cast<Method>(state["method"].cast<int>());
    options.inside = static_cast<Inside>(state["inside"].cast<int>());
    if (const auto material = state["material"].cast<std::optional<Material>>())
        options.material = std::make_shared<Material>(*material);
    const auto volume = state["volume"].cast<std::shared_ptr<Volume>>();
    const auto level = state["level"].cast<double>();
    std::shared_ptr<Isosurface> surface;
    long_call("to make an isosurface", py::none(), [&](const Progress& progress) {
        surface = std::make_shared<Isosurface>(volume, level, std::move(options), nullptr, progress);
    });
    return surface;
}

// Images.

/// Calls `visit(name, layer)` for each list of pixels of an image.
template <typename GivenImage, typename Visit>
void for_each_layer(GivenImage& image, const Visit& visit)
{
    visit("color", image.color);
    visit("srgb8", image.srgb8);
    visit("depth", image.depth);
    visit("position", image.position);
    visit("normal", image.normal);
    visit("albedo", image.albedo);
    visit("gradient_magnitude", image.gradient_magnitude);
    visit("curvature", image.curvature);
    visit("ambient_occlusion", image.ambient_occlusion);
    visit("direct", image.direct);
    visit("variance", image.variance);
    visit("geometry_ids", image.geometry_ids);
    visit("primitive_ids", image.primitive_ids);
    visit("certified", image.certified);
}

py::dict image_state(const py::object& self)
{
    const auto& image = self.cast<const Image&>();
    py::dict state, layers;
    for_each_layer(image, [&](const char* name, const auto& layer) {
        if (!layer.empty())
            layers[name] = view_of(reinterpret_cast<const std::uint8_t*>(layer.data()),
                                   layer.size() * sizeof(layer.front()), self);
    });
    state["size"] = py::make_tuple(image.size.x, image.size.y);
    state["full_size"] = py::make_tuple(image.full_size.x, image.full_size.y);
    state["first"] = py::make_tuple(image.first.x, image.first.y);
    state["layers"] = layers;
    state["covered_count"] = image.covered_count;
    state["world_to_camera"] = image.world_to_camera;
    state["world_to_ndc"] = image.world_to_ndc;
    state["pixel_aspect_ratio"] = image.pixel_aspect_ratio;
    return state;
}

std::unique_ptr<Image> image_of(const py::dict& state)
{
    auto image = std::make_unique<Image>();
    const auto pair = [&](const char* name) {
        const auto numbers = state[name].cast<std::array<int, 2>>();
        return glm::ivec2(numbers[0], numbers[1]);
    };
    image->size = pair("size");
    image->full_size = pair("full_size");
    image->first = pair("first");
    const auto layers = state["layers"].cast<py::dict>();
    for_each_layer(*image, [&](const char* name, auto& layer) {
        if (!layers.contains(name))
            return;
        const auto bytes = array_of<std::uint8_t>(layers, name);
        layer.resize(image->pixel_count());
        const std::size_t expected = layer.size() * sizeof(layer.front());
        if (static_cast<std::size_t>(bytes.size()) != expected)
            throw_invalid(name, std::to_string(expected) + " bytes", bytes.size());
        std::memcpy(layer.data(), bytes.data(), expected);
    });
    image->covered_count = state["covered_count"].cast<std::size_t>();
    image->world_to_camera = as_matrix4(state["world_to_camera"], "world_to_camera");
    if (!state["world_to_ndc"].is_none())
        image->world_to_ndc = as_matrix4(state["world_to_ndc"], "world_to_ndc");
    image->pixel_aspect_ratio = state["pixel_aspect_ratio"].cast<double>();
    return image;
}

} // namespace

py::dict dict_of(const VolumeOptions& options, const VolumeSummary& summary)
{
    py::dict state;
    state["spacing"] = options.spacing;
    state["origin"] = options.origin;
    state["direction"] = options.direction;
    state["degree"] = options.degree;
    state["boundary"] = static_cast<int>(options.boundary);
    state["filter"] = static_cast<int>(options.filter);
    state["smoothing"] = options.smoothing;
    state["axes"] = static_cast<int>(options.axes);
    state["unit"] = options.unit;
    state["patient"] = options.patient;
    state["shape"] = py::make_tuple(summary.shape.x, summary.shape.y, summary.shape.z);
    state["minimum"] = summary.minimum;
    state["maximum"] = summary.maximum;
    state["offset"] = summary.offset;
    return state;
}

VolumeOptions options_in(const py::dict& state)
{
    VolumeOptions options;
    options.spacing = as_vector(state["spacing"], "spacing");
    options.origin = as_vector(state["origin"], "origin");
    options.direction = as_matrix3(state["direction"], "direction");
    options.degree = state["degree"].cast<int>();
    options.boundary = static_cast<Boundary>(state["boundary"].cast<int>());
    options.filter = static_cast<Filter>(state["filter"].cast<int>());
    options.smoothing = state["smoothing"].cast<double>();
    options.axes = static_cast<Axes>(state["axes"].cast<int>());
    options.unit = state["unit"].cast<std::string>();
    options.patient = state["patient"].cast<bool>();
    return options;
}

VolumeSummary summary_in(const py::dict& state)
{
    const auto shape = state["shape"].cast<py::tuple>();
    VolumeSummary summary;
    for (int axis = 0; axis < 3; ++axis)
        summary.shape[axis] = shape[static_cast<std::size_t>(axis)].cast<int>();
    summary.minimum = state["minimum"].cast<double>();
    summary.maximum = state["maximum"].cast<double>();
    summary.offset = state["offset"].cast<double>();
    return summary;
}

void bind_state(py::module_& module)
{
    py::class_<Volume, std::shared_ptr<Volume>>(module.attr("Volume")).def(py::pickle(&volume_state, &volume_of));
    py::class_<Isosurface, std::shared_ptr<Isosurface>>(module.attr("Isosurface"))
        .def(py::pickle(&isosurface_state, &isosurface_of));
    py::class_<Image>(module.attr("Image")).def(py::pickle(&image_state, &image_of));
}

} // namespace isospline
