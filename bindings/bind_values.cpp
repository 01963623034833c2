#include "arrays.h"
#include "bind.h"
#include "colors.h"
#include "lights.h"
#include "values.h"

#include <string>
#include <variant>

namespace py = pybind11;

namespace isospline {

namespace {

/// The classes by their names. They live as long as the process: Python may end first.
py::dict& classes()
{
    static auto* const known = new py::dict;
    return *known;
}

} // namespace

bool is_value(const py::handle& object, const char* name)
{
    return classes().contains(name) && py::isinstance(object, classes()[name]);
}

py::object value_class(const char* name)
{
    return classes()[name];
}

void bind_values(py::module_& module)
{
    module.def(
        "_add_value_class", [](const py::type& given) { classes()[given.attr("__name__")] = given; }, py::arg("given"));
    // A new array, which does not share the memory of the given one.
    module.def(
        "_doubles",
        [](const py::object& value, const std::string& parameter, const Shape& shape) {
            return py::array_t<double>(as_doubles(value, parameter.c_str(), shape).request());
        },
        py::arg("value"), py::arg("parameter"), py::arg("shape"));
    module.def(
        "_color",
        [](const py::object& value, const std::string& parameter) { return as_color(value, parameter.c_str()); },
        py::arg("value"), py::arg("parameter"));
    using AnyLight = std::variant<PositionalLight, DirectionalLight, RectangleLight, SphereLight>;
    module.def(
        "_check_light",
        [](const py::object& light) { std::visit([](const auto& each) { validate(each); }, light.cast<AnyLight>()); },
        py::arg("light"));
}

} // namespace isospline
