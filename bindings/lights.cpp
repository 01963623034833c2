#include "lights.h"

#include "arrays.h"
#include "values.h"

namespace py = pybind11;
using namespace py::literals;

namespace isospline {

namespace {

glm::dvec3 vector_of(const py::handle& object, const char* name)
{
    return as_vector(object.attr(name), name);
}

double number_of(const py::handle& object, const char* name)
{
    return object.attr(name).cast<double>();
}

} // namespace

template <>
std::optional<PositionalLight> light_in(const py::handle& object)
{
    if (!is_value(object, "PositionalLight"))
        return std::nullopt;
    return PositionalLight{vector_of(object, "position"), vector_of(object, "intensity")};
}

template <>
std::optional<DirectionalLight> light_in(const py::handle& object)
{
    if (!is_value(object, "DirectionalLight"))
        return std::nullopt;
    return DirectionalLight(vector_of(object, "direction"), vector_of(object, "intensity"), number_of(object, "angle"));
}

template <>
std::optional<RectangleLight> light_in(const py::handle& object)
{
    if (!is_value(object, "RectangleLight"))
        return std::nullopt;
    return RectangleLight{vector_of(object, "corner"), vector_of(object, "edge_u"), vector_of(object, "edge_v"),
                          vector_of(object, "radiance")};
}

template <>
std::optional<SphereLight> light_in(const py::handle& object)
{
    if (!is_value(object, "SphereLight"))
        return std::nullopt;
    return SphereLight{vector_of(object, "center"), number_of(object, "radius"), vector_of(object, "radiance")};
}

py::object to_python(const PositionalLight& light)
{
    return value_class("PositionalLight")(light.position, "intensity"_a = light.intensity);
}

py::object to_python(const DirectionalLight& light)
{
    return value_class("DirectionalLight")(light.direction, "intensity"_a = light.intensity, "angle"_a = light.angle);
}

py::object to_python(const RectangleLight& light)
{
    return value_class("RectangleLight")(light.corner, light.edge_u, light.edge_v, "radiance"_a = light.radiance);
}

py::object to_python(const SphereLight& light)
{
    return value_class("SphereLight")(light.center, light.radius, "radiance"_a = light.radiance);
}

} // namespace isospline
