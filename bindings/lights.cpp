#include "lights.h"

#include "arrays.h"

namespace py = pybind11;
using namespace py::literals;

namespace isospline {

namespace {

glm::dvec3 vector_of(const py::handle& light, const char* name)
{
    return as_vector(light.attr(name), name);
}

double number_of(const py::handle& light, const char* name)
{
    return light.attr(name).cast<double>();
}

} // namespace

PositionalLight ValueConversion<PositionalLight>::from_python(py::handle light)
{
    return {vector_of(light, "position"), vector_of(light, "intensity")};
}

py::object ValueConversion<PositionalLight>::to_python(const PositionalLight& light)
{
    return value_class(name)(light.position, "intensity"_a = light.intensity);
}

DirectionalLight ValueConversion<DirectionalLight>::from_python(py::handle light)
{
    return DirectionalLight(vector_of(light, "direction"), vector_of(light, "intensity"), number_of(light, "angle"));
}

py::object ValueConversion<DirectionalLight>::to_python(const DirectionalLight& light)
{
    return value_class(name)(light.direction, "intensity"_a = light.intensity, "angle"_a = light.angle);
}

RectangleLight ValueConversion<RectangleLight>::from_python(py::handle light)
{
    return {vector_of(light, "corner"), vector_of(light, "edge_u"), vector_of(light, "edge_v"),
            vector_of(light, "radiance")};
}

py::object ValueConversion<RectangleLight>::to_python(const RectangleLight& light)
{
    return value_class(name)(light.corner, light.edge_u, light.edge_v, "radiance"_a = light.radiance);
}

SphereLight ValueConversion<SphereLight>::from_python(py::handle light)
{
    return {vector_of(light, "center"), number_of(light, "radius"), vector_of(light, "radiance")};
}

py::object ValueConversion<SphereLight>::to_python(const SphereLight& light)
{
    return value_class(name)(light.center, light.radius, "radiance"_a = light.radiance);
}

} // namespace isospline
