#include "arrays.h"
#include "bind.h"
#include "colors.h"
#include "environment.h"
#include "looks.h"
#include "values.h"

#include "isospline/render/path_tracer.h"
#include "isospline/shade/material.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <unordered_map>
#include <variant>

namespace py = pybind11;

namespace isospline {

namespace {

/// What the package has handed over, by its names. It lives as long as the process: Python may end first.
py::dict& known()
{
    static auto* const objects = new py::dict;
    return *objects;
}

/// The scattering function of a material for directions of any shape, (..., 3).
py::array_t<double> evaluate(const Material& material, const py::object& to_viewer, const py::object& to_light)
{
    const RowArray viewer(to_viewer, "to_viewer", 3), light(to_light, "to_light", 3);
    if (viewer.leading_shape() != light.leading_shape())
        throw_invalid("to_light", "the shape of to_viewer, " + to_text(viewer.leading_shape()),
                      to_text(light.leading_shape()));
    if (!std::holds_alternative<glm::dvec3>(color_of(material)))
        throw_invalid("color", "a constant colour, because no point is given",
                      py::str(py::type::of(written(material.color)).attr("__name__")).cast<std::string>());
    py::array_t<double> result = new_array<double>(viewer.leading_shape(), {3});
    const Scattering scattering(material);
    for (std::size_t i = 0; i < viewer.count(); ++i) {
        const glm::dvec3 f = scattering.evaluate(viewer.vector(i), light.vector(i));
        std::copy(&f[0], &f[0] + 3, result.mutable_data() + 3 * i);
    }
    return result;
}

/// Makes a class that is derived from a compiled one the class of all such objects, also of those that C++ makes. The
/// compiled class has no objects of its own any more.
void derive(const py::type& derived)
{
    auto* const kind = reinterpret_cast<PyTypeObject*>(derived.inc_ref().ptr());
    py::detail::type_info* const info = py::detail::get_type_info(kind);
    info->type->tp_new = [](PyTypeObject* compiled, PyObject*, PyObject*) -> PyObject* {
        PyErr_Format(PyExc_TypeError, "%s: expected the class of the package that is derived from it",
                     compiled->tp_name);
        return nullptr;
    };
    info->type = kind;
}

} // namespace

py::object handed(const char* name)
{
    return known()[name];
}

bool is_value(const py::handle& object, const char* name)
{
    return known().contains(name) && py::isinstance(object, known()[name]);
}

py::object value_part(const py::handle& value, const char* name)
{
    const py::dict exact = value.attr("_exact");
    return exact.contains(name) ? py::object(exact[name]) : py::object(value.attr(name));
}

py::object material_in_python(const std::shared_ptr<const Material>& material)
{
    if (!material)
        return py::none();
    const auto is_rule = [](const CapColor& color) { return color && !std::holds_alternative<glm::dvec3>(*color); };
    if (is_rule(material->color) || is_rule(material->cap_color)) // what is kept must not hold volumes
        return py::cast(*material);
    struct Made {
        std::weak_ptr<const Material> material;
        py::object value;
    };
    static auto* const made = new std::unordered_map<const Material*, Made>; // as long as the process, like known()
    static std::size_t limit = 64;
    const auto found = made->find(material.get());
    if (found != made->end() && found->second.material.lock() == material)
        return found->second.value;
    if (made->size() >= limit) {
        std::erase_if(*made, [](const auto& each) { return each.second.material.expired(); });
        limit = std::max<std::size_t>(64, 2 * made->size());
    }
    const py::object value = py::cast(*material);
    made->insert_or_assign(material.get(), Made{material, value});
    return value;
}

void bind_values(py::module_& module)
{
    module.def(
        "_hand", [](const py::object& named) { known()[named.attr("__name__")] = named; }, py::arg("named"));
    module.def("_derive", &derive, py::arg("derived"));
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
    module.def(
        "_check_light",
        [](const py::object& light) { std::visit([](const auto& each) { validate(each); }, light.cast<Emitter>()); },
        py::arg("light"));
    module.def(
        "_look_color",
        [](const py::object& value, const std::string& parameter) {
            return to_python(as_surface_color(value, parameter.c_str()));
        },
        py::arg("value"), py::arg("parameter"));
    module.def(
        "_check_look",
        [](const py::object& look) {
            if (is_value(look, ValueClass<Material>::name))
                validate(look.cast<Material>());
            else
                validate(look.cast<Shading>());
        },
        py::arg("look"));
    module.def("_evaluate_material", &evaluate, py::arg("material"), py::arg("to_viewer"), py::arg("to_light"));
}

} // namespace isospline
