#include "arrays.h"
#include "bind.h"
#include "colors.h"
#include "layers.h"
#include "long_call.h"

#include "isospline/io/atomic_file.h"
#include "isospline/io/exr.h"
#include "isospline/render/renderer.h"
#include "isospline/scene/scene.h"
#include "isospline/util/parallel.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace py = pybind11;

namespace isospline {

namespace {

using ShadingOfGeometry = std::map<std::uint32_t, Shading>;
using GivenShading = std::variant<Shading, ShadingOfGeometry>;

std::unique_ptr<Image> render_scene(Scene& scene, const Camera& camera, std::array<int, 2> size, GivenShading shading,
                                    const py::object& background, int samples, const py::object& layers,
                                    int ambient_occlusion_samples, const std::string& encoding,
                                    const py::object& progress)
{
    RenderOptions options;
    options.size = {size[0], size[1]};
    options.background = as_background(background, "background");
    options.samples = samples;
    options.layers = as_layers(layers, ambient_occlusion_samples);
    options.encoding = as_enum(color_encodings, encoding, "encoding");
    if (auto* by_geometry = std::get_if<ShadingOfGeometry>(&shading))
        options.shading_of_geometry = std::move(*by_geometry);
    else
        options.shading = std::get<Shading>(std::move(shading));

    auto image = std::make_unique<Image>();
    long_call("to render " + size_text(options.size.x, options.size.y), progress, [&](const Progress& report) {
        const auto snapshot = scene.snapshot(part_of(report, 0.0, 0.1));
        *image = render(*snapshot, camera, options, part_of(report, 0.1, 1.0));
    });
    return image;
}

/// A path as Python has it: what is not UTF-8 is escaped.
py::str fs_text(const std::filesystem::path& path)
{
    return py::reinterpret_steal<py::str>(PyUnicode_DecodeFSDefault(path.c_str()));
}

/// An array over an image's own memory, which keeps the image alive; None where the image has none.
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

/// The linear colour of an image, which Python may have changed, in 8-bit sRGB.
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

void bind_image(py::module_& module)
{
    py::tuple names(std::size(layer_names));
    for (std::size_t i = 0; i < names.size(); ++i)
        names[i] = layer_names[i].name;
    module.attr("LAYERS") = names;
    py::class_<Image>(module, "Image", "The arrays of an image; isospline.Image has the rest.")
        .def("copy", [](const Image& image) { return std::make_unique<Image>(image); })
        .def_property_readonly("size",
                               [](const Image& image) {
                                   return std::array<int, 2>{image.size.x, image.size.y};
                               })
        .def_property_readonly("covered_count", [](const Image& image) { return image.covered_count; })
        .def_property_readonly("color", [](const py::object& self) { return view<float>(self, &Image::color); })
        .def_property_readonly("srgb8", [](const py::object& self) { return view<std::uint8_t>(self, &Image::srgb8); })
        .def("to_srgb8", &encoded)
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
        .def_property_readonly("variance", [](const py::object& self) { return view<float>(self, &Image::variance); })
        .def_property_readonly("world_to_camera", [](const Image& image) { return to_array(image.world_to_camera); })
        .def_property_readonly("world_to_ndc",
                               [](const Image& image) -> std::optional<py::array_t<double>> {
                                   if (!image.world_to_ndc)
                                       return std::nullopt;
                                   return to_array(*image.world_to_ndc);
                               })
        .def(
            "write_exr",
            [](const Image& image, const std::filesystem::path& path, bool half) {
                long_call("to write an EXR file", py::none(),
                          [&](const Progress& report) { write_exr(image, path, {half}, report); });
            },
            py::arg("path"), py::kw_only(), py::arg("half") = false);
}

/// What writes to a file by its name, such as FFmpeg, has the same rules as what writes to AtomicFile's stream.
void bind_output_file(py::module_& module)
{
    py::class_<AtomicFile>(module, "OutputFile", "A file that takes its target's place whole or not at all.")
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

void bind_render(py::module_& module)
{
    py::register_local_exception_translator(translate_file_error);
    bind_image(module);
    bind_output_file(module);
    module.def("render", &render_scene, py::arg("scene"), py::arg("camera"), py::kw_only(), py::arg("size"),
               py::arg("shading"), py::arg("background"), py::arg("samples"), py::arg("layers"),
               py::arg("ambient_occlusion_samples"), py::arg("encoding"), py::arg("progress"),
               "The arrays of isospline.render().");
}

} // namespace isospline
