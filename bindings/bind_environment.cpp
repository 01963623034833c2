#include "arrays.h"
#include "bind.h"
#include "environment.h"

#include "isospline/util/check.h"

#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

std::shared_ptr<EnvironmentMap> as_map(const py::object& image)
{
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

/// The pixels of a map, without a copy.
py::object image_of(const py::object& self)
{
    const auto& map = self.cast<const EnvironmentMap&>();
    const Shape shape{map.size().y, map.size().x, 3};
    return read_only(py::array_t<float>(shape, reinterpret_cast<const float*>(map.pixels().data()), self));
}

} // namespace

EnvironmentLight ValueConversion<EnvironmentLight>::from_python(py::handle light)
{
    const auto map = light.attr("_map").cast<std::shared_ptr<EnvironmentMap>>();
    return {as_vector(light.attr("radiance"), "radiance"), map, as_matrix3(light.attr("rotation"), "rotation"),
            light.attr("visible").cast<bool>()};
}

py::object ValueConversion<EnvironmentLight>::to_python(const EnvironmentLight& light)
{
    return handed(name).attr("_with")(std::const_pointer_cast<EnvironmentMap>(light.map), light.radiance,
                                      light.rotation, light.visible);
}

void bind_environment(py::module_& module)
{
    py::class_<EnvironmentMap, std::shared_ptr<EnvironmentMap>>(module, "_EnvironmentMap")
        .def(py::init(&as_map), py::arg("image"))
        .def_property_readonly("image", &image_of);
}

} // namespace isospline
