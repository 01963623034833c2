#include "arrays.h"
#include "bind.h"
#include "colors.h"
#include "layers.h"
#include "long_call.h"

#include "isospline/io/atomic_file.h"
#include "isospline/io/exr.h"
#include "isospline/render/image.h"
#include "isospline/render/tone.h"
#include "isospline/util/parallel.h"

#include <pybind11/numpy.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;
using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// A path as a Python string: bytes that are not UTF-8 are escaped.
py::str fs_text(const std::filesystem::path& path)
{
    return py::reinterpret_steal<py::str>(PyUnicode_DecodeFSDefault(path.c_str()));
}

/// An array over an image's own memory, which keeps the image alive; None if the image does not have it.
template <typename Value, typename Element>
py::object view(const py::object& image, std::vector<Element> Image::*array)
{
    Image& pixels = image.cast<Image&>();
    if ((pixels.*array).empty())
        return py::none();
    std::vector<py::ssize_t> shape{pixels.size.y, pixels.size.x};
    if constexpr (sizeof(Element) > sizeof(Value))
        shape.push_back(sizeof(Element) / sizeof(Value));
    return py::array_t<Value>(shape, reinterpret_cast<Value*>((pixels.*array).data()), image);
}

/// The linear colour of an image in 8-bit sRGB. Python may have changed the colour.
py::array_t<std::uint8_t> encoded(const Image& image)
{
    auto array = new_array<std::uint8_t>(Shape{image.size.y, image.size.x, 4});
    auto* const pixels = reinterpret_cast<glm::u8vec4*>(array.mutable_data());
    long_call("to encode colours", py::none(), [&](const Progress& progress) {
        parallel_for(
            image.color.size(), 1 << 14,
            [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    pixels[i] = to_srgb8(image.color[i]);
            },
            progress);
    });
    return array;
}

/// Calls `change(color, i)` for the colour of each pixel of an image and its number, in parallel.
template <typename Change>
void change_colors(Image& image, const Change& change)
{
    long_call("to change colours", py::none(), [&](const Progress& progress) {
        parallel_for(
            image.color.size(), 1 << 14,
            [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    change(image.color[i], i);
            },
            progress);
    });
}

/// Stores linear colours (height, width, 4), premultiplied by the parts of pixels that surfaces cover.
void set_color(Image& image, const FloatArray& colors)
{
    if (colors.ndim() != 3 || colors.shape(0) != image.size.y || colors.shape(1) != image.size.x ||
        colors.shape(2) != 4)
        throw_invalid("colors", "shape (height, width, 4)", colors.ndim());
    image.color.resize(image.pixel_count());
    std::copy_n(colors.data(), colors.size(), &image.color.front().x);
    image.covered_count = static_cast<std::size_t>(
        std::count_if(image.color.begin(), image.color.end(), [](const glm::vec4& color) { return color.a > 0.0f; }));
}

/// Stores the linear colour of an image in 8-bit sRGB instead.
void encode(Image& image)
{
    image.srgb8.resize(image.color.size());
    change_colors(image, [&](const glm::vec4& color, std::size_t i) { image.srgb8[i] = to_srgb8(color); });
    image.color.clear();
}

/// Maps the parts of pixels that surfaces cover, `factor` times as bright.
void tone_map(Image& image, const std::string& curve, double factor)
{
    const ToneCurve given = as_enum(tone_curves, curve, "curve");
    change_colors(image, [&](glm::vec4& color, std::size_t) {
        const double alpha = color.a > 0.0f ? color.a : 1.0;
        color = glm::vec4(alpha * tone_mapped(factor / alpha * glm::dvec3(color), given), color.a);
    });
}

/// Lays an image over a background, of which a part `shade` (height, width) is taken away and becomes opaque black.
void lay_over(Image& image, const glm::vec4& background, const std::optional<FloatArray>& shade)
{
    if (shade && static_cast<std::size_t>(shade->size()) != image.color.size())
        throw_invalid("shade", "a number for each pixel", shade->size());
    const float* const shades = shade ? shade->data() : nullptr;
    change_colors(image, [&](glm::vec4& color, std::size_t i) {
        const float dark = shades ? std::clamp(shades[i], 0.0f, 1.0f) : 0.0f, left = 1.0f - color.a;
        const float behind = left * (1.0f - dark) * background.a;
        color += glm::vec4(behind * glm::vec3(background), left * (background.a + (1.0f - background.a) * dark));
    });
}

/// The colours (N, 3) after a curve.
py::array_t<double> tone_mapped_colors(const DoubleArray& colors, const std::string& curve)
{
    if (colors.ndim() != 2 || colors.shape(1) != 3)
        throw_invalid("colors", "shape (N, 3)", colors.ndim());
    const ToneCurve given = as_enum(tone_curves, curve, "curve");
    py::array_t<double> result({colors.shape(0), py::ssize_t{3}});
    for (py::ssize_t i = 0; i < colors.shape(0); ++i) {
        const glm::dvec3 color = tone_mapped({colors.at(i, 0), colors.at(i, 1), colors.at(i, 2)}, given);
        for (int part = 0; part < 3; ++part)
            result.mutable_at(i, part) = color[part];
    }
    return result;
}

void bind_class(py::module_& module)
{
    py::tuple names(std::size(layer_names));
    for (std::size_t i = 0; i < names.size(); ++i)
        names[i] = layer_names[i].name;
    module.attr("LAYERS") = names;
    py::class_<Image>(module, "Image")
        .def("copy", [](const Image& image) { return std::make_unique<Image>(image); })
        .def("blank", [](const Image& image) { return std::make_unique<Image>(image.blank()); })
        .def_property_readonly("size",
                               [](const Image& image) {
                                   return std::array<int, 2>{image.size.x, image.size.y};
                               })
        .def_property_readonly("full_size",
                               [](const Image& image) {
                                   return std::array<int, 2>{image.full_size.x, image.full_size.y};
                               })
        .def_property_readonly("first",
                               [](const Image& image) {
                                   return std::array<int, 2>{image.first.x, image.first.y};
                               })
        .def_property_readonly("covered_count", [](const Image& image) { return image.covered_count; })
        .def_property_readonly("color", [](const py::object& self) { return view<float>(self, &Image::color); })
        .def_property_readonly("srgb8", [](const py::object& self) { return view<std::uint8_t>(self, &Image::srgb8); })
        .def("to_srgb8", &encoded)
        .def("set_color", &set_color, py::arg("colors"))
        .def("encode_srgb8", &encode)
        .def("tone_map", &tone_map, py::arg("curve"), py::arg("factor") = 1.0)
        .def(
            "lay_over",
            [](Image& image, const py::object& background, const std::optional<FloatArray>& shade) {
                lay_over(image, as_background(background, "background"), shade);
            },
            py::arg("background"), py::arg("shade") = py::none())
        .def_property_readonly("depth", [](const py::object& self) { return view<float>(self, &Image::depth); })
        .def_property_readonly("position", [](const py::object& self) { return view<float>(self, &Image::position); })
        .def_property_readonly("normal", [](const py::object& self) { return view<float>(self, &Image::normal); })
        .def_property_readonly("albedo", [](const py::object& self) { return view<float>(self, &Image::albedo); })
        .def_property_readonly("gradient_magnitude",
                               [](const py::object& self) { return view<float>(self, &Image::gradient_magnitude); })
        .def_property_readonly("curvature", [](const py::object& self) { return view<float>(self, &Image::curvature); })
        .def_property_readonly("ambient_occlusion",
                               [](const py::object& self) { return view<float>(self, &Image::ambient_occlusion); })
        .def_property_readonly("direct", [](const py::object& self) { return view<float>(self, &Image::direct); })
        .def_property_readonly("geometry_ids",
                               [](const py::object& self) { return view<std::uint32_t>(self, &Image::geometry_ids); })
        .def_property_readonly("primitive_ids",
                               [](const py::object& self) { return view<std::uint64_t>(self, &Image::primitive_ids); })
        .def_property_readonly("certified",
                               [](const py::object& self) { return view<std::uint32_t>(self, &Image::certified); })
        .def_property_readonly("variance", [](const py::object& self) { return view<float>(self, &Image::variance); })
        .def_readonly("world_to_camera", &Image::world_to_camera)
        .def_readonly("world_to_ndc", &Image::world_to_ndc)
        .def(
            "write_exr",
            [](const Image& image, const std::filesystem::path& path, bool half) {
                long_call("to write an EXR file", py::none(),
                          [&](const Progress& report) { write_exr(image, path, {half}, report); });
            },
            py::arg("path"), py::kw_only(), py::arg("half") = false);
}

/// For programs that write to a file by its name, such as FFmpeg: the same rules as for AtomicFile's stream.
void bind_output_file(py::module_& module)
{
    py::class_<AtomicFile>(module, "OutputFile")
        .def(py::init<const std::filesystem::path&>(), py::arg("target"))
        .def_property_readonly("temporary", [](const AtomicFile& file) { return fs_text(file.temporary()); })
        .def("commit", &AtomicFile::commit)
        .def("discard", &AtomicFile::discard);
}

/// Errors of files become OSError, or the subclass that fits, with errno and filename.
void translate_file_error(std::exception_ptr raised)
{
    try {
        std::rethrow_exception(std::move(raised));
    } catch (const std::filesystem::filesystem_error& error) {
        const py::object type = py::reinterpret_borrow<py::object>(PyExc_OSError);
        const py::object value = type(error.code().value(), error.code().message(), fs_text(error.path1()));
        PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(value.ptr())), value.ptr());
    }
}

} // namespace

void bind_image(py::module_& module)
{
    py::register_local_exception_translator(translate_file_error);
    bind_class(module);
    bind_output_file(module);
    module.def("tone_mapped", &tone_mapped_colors, py::arg("colors"), py::arg("curve"));
}

} // namespace isospline
