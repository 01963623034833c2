#include "arrays.h"
#include "bind.h"
#include "colors.h"
#include "handed.h"

#include "isospline/shade/environment_light.h"
#include "isospline/util/check.h"

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* environment_doc = R"(Light from infinitely far away, from all directions, for a `PathTracer`.

Parameters
----------
radiance : float, (3,) float, path or (height, width, 3) array
    Linear red, green and blue, or one number for all three; if there is an `image`, a factor of it. Or the image
    itself: an array, or the path of an .exr or .hdr file, see `read_environment`; the factor is then 1.
image : (height, width, 3) array_like of numbers, optional
    Linear radiance by direction: an equirectangular panorama. The top row is z, the bottom row is -z, x is in the
    middle, and y is in the middle of the left half. The radiance is constant within a pixel. Directions are sampled in
    proportion to their light.
rotation : (3, 3) array_like, optional
    Columns are the world directions of the image's x, y and z.
visible : bool
    Whether the camera sees it behind the surfaces.

Raises
------
ValueError
    For numbers that are negative or not finite, an image of another shape, and a matrix that is not a rotation.
TypeError
    If both `radiance` and `image` are panoramas.

Examples
--------
>>> import numpy as np
>>> import isospline
>>> sky = np.zeros((16, 32, 3))
>>> sky[:8] = (0.5, 0.7, 1.0)  # above the horizon
>>> light = isospline.EnvironmentLight(image=sky)
)";

std::shared_ptr<const EnvironmentMap> as_map(const py::object& image)
{
    if (image.is_none())
        return nullptr;
    const py::array array = as_array(image, "image", "iuf");
    if (array.ndim() != 3 || array.shape(2) != 3)
        throw_invalid("image", "shape (height, width, 3)", to_text(shape_of(array)));
    constexpr py::ssize_t largest = std::numeric_limits<int>::max();
    if (array.shape(0) > largest || array.shape(1) > largest)
        throw_invalid("image", "a width and a height of at most " + std::to_string(largest), to_text(shape_of(array)));
    const py::array_t<float, py::array::c_style | py::array::forcecast> numbers(array);
    const auto* const first = reinterpret_cast<const glm::vec3*>(numbers.data());
    return std::make_shared<EnvironmentMap>(glm::ivec2(numbers.shape(1), numbers.shape(0)),
                                            std::vector<glm::vec3>(first, first + numbers.shape(0) * numbers.shape(1)));
}

} // namespace

void bind_environment(py::module_& module)
{
    py::class_<EnvironmentLight>(module, "EnvironmentLight", environment_doc)
        .def(
            py::init([](const py::object& radiance, const py::object& image, const py::object& rotation, bool visible) {
                const py::object sky = handed("sky_of")(radiance, image);
                EnvironmentLight light{as_color(sky.is_none() ? radiance : py::cast(1.0), "radiance"),
                                       as_map(sky.is_none() ? image : sky), glm::dmat3(1.0), visible};
                if (!rotation.is_none())
                    light.rotation = as_matrix3(rotation, "rotation");
                validate(light);
                return light;
            }),
            py::arg("radiance") = 1.0, py::kw_only(), py::arg("image") = py::none(), py::arg("rotation") = py::none(),
            py::arg("visible") = false)
        .def_readonly("radiance", &EnvironmentLight::radiance)
        .def_property_readonly("image",
                               [](const EnvironmentLight& light) -> py::object {
                                   if (!light.map)
                                       return py::none();
                                   const Shape shape{light.map->size().y, light.map->size().x, 3};
                                   return py::array_t<float>(
                                       shape, reinterpret_cast<const float*>(light.map->pixels().data()));
                               })
        .def_readonly("rotation", &EnvironmentLight::rotation)
        .def_readonly("visible", &EnvironmentLight::visible)
        .def("__repr__", [](const EnvironmentLight& light) {
            const std::string image = !light.map ? ""
                                                 : ", image of " + std::to_string(light.map->size().x) + " x " +
                                                       std::to_string(light.map->size().y);
            return "EnvironmentLight(" + to_text(light.radiance) + image +
                   ", visible=" + (light.visible ? "True" : "False") + ")";
        });
}

} // namespace isospline
