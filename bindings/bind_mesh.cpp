#include "arrays.h"
#include "bind.h"
#include "colors.h"
#include "handed.h"
#include "long_call.h"
#include "look.h"

#include "isospline/scene/mesh.h"
#include "isospline/shade/material.h"
#include "isospline/util/check.h"

#include <glm/gtc/color_space.hpp>
#include <pybind11/numpy.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

std::vector<glm::dvec3> as_vectors(const py::object& value, const char* parameter)
{
    const py::array array = as_array(value, parameter, "iuf");
    if (array.ndim() > 0)
        check_count(parameter, static_cast<std::uint64_t>(array.shape(0)));
    const RowArray rows(array, parameter, 3);
    if (rows.leading_shape().size() != 1)
        throw_invalid(parameter, "shape (V, 3)", std::to_string(rows.leading_shape().size() + 1) + " dimensions");
    std::vector<glm::dvec3> vectors;
    long_call("to copy vectors", py::none(), [&](const Progress&) {
        vectors.resize(rows.count());
        for (std::size_t i = 0; i < vectors.size(); ++i)
            vectors[i] = rows.vector(i);
    });
    return vectors;
}

/// One vector per vertex; empty for None.
std::vector<glm::dvec3> as_vertex_vectors(const py::object& value, const char* parameter, std::size_t vertex_count)
{
    if (value.is_none())
        return {};
    std::vector<glm::dvec3> vectors = as_vectors(value, parameter);
    if (vectors.size() != vertex_count)
        throw_invalid(parameter, "shape (" + std::to_string(vertex_count) + ", 3), as for vertices",
                      "(" + std::to_string(vectors.size()) + ", 3)");
    return vectors;
}

/// Linear colours, from numbers or names.
std::vector<glm::dvec3> as_vertex_colors(const py::object& value, std::size_t vertex_count)
{
    if (value.is_none())
        return {};
    const py::object named = handed("vertex_colors")(value, vertex_count);
    const py::object colors = as_array(named, "colors", "iuf");
    std::vector<glm::dvec3> linear = as_vertex_vectors(colors, "colors", vertex_count);
    const bool has_eight_bits = py::isinstance<py::array_t<std::uint8_t>>(colors);
    for (glm::dvec3& color : linear) {
        if (has_eight_bits)
            color = glm::convertSRGBToLinear(color / 255.0);
        check_not_above_one(color, py::cast(color), "colors");
    }
    return linear;
}

VertexValues as_vertex_values(const py::object& value, std::string name, std::size_t vertex_count)
{
    VertexValues values{{}, std::move(name)};
    if (values.name.empty())
        throw_invalid("values_name", "a name", "an empty text");
    if (value.is_none())
        return values;
    const py::array array = as_array(value, "values", "iuf");
    if (array.ndim() != 1 || static_cast<std::size_t>(array.shape(0)) != vertex_count)
        throw_invalid("values", "shape (" + std::to_string(vertex_count) + ",), one for each vertex",
                      to_text(shape_of(array)));
    const py::array_t<double, py::array::c_style | py::array::forcecast> numbers(array);
    values.numbers.assign(numbers.data(), numbers.data() + numbers.size());
    return values;
}

/// The rows of a mesh's list of vectors, or None if it is empty.
py::object view_or_none(const py::object& self, const std::vector<glm::dvec3>& vectors)
{
    if (vectors.empty())
        return py::none();
    return read_only(py::array_t<double>({static_cast<py::ssize_t>(vectors.size()), py::ssize_t{3}},
                                         reinterpret_cast<const double*>(vectors.data()), self));
}

/// A mesh with some of its attributes replaced.
std::shared_ptr<Mesh> converted_mesh(const py::object& given, const py::object& normals, const py::object& colors,
                                     std::shared_ptr<const Material> material, const py::object& values,
                                     std::string values_name)
{
    const auto mesh = given.cast<std::shared_ptr<Mesh>>();
    const std::size_t count = mesh->vertices().size();
    return std::make_shared<Mesh>(mesh->vertices(), mesh->faces(),
                                  normals.is_none() ? mesh->normals() : as_vertex_vectors(normals, "normals", count),
                                  colors.is_none() ? mesh->colors() : as_vertex_colors(colors, count),
                                  material ? std::move(material) : mesh->material(),
                                  values.is_none() ? mesh->values()
                                                   : as_vertex_values(values, std::move(values_name), count));
}

std::shared_ptr<Mesh> make_mesh(const py::object& vertices, const py::object& faces, const py::object& normals,
                                const py::object& colors, const std::optional<Material>& given_material,
                                const py::object& values, std::string values_name, const py::object& color,
                                const py::object& opacity, const py::object& name)
{
    std::shared_ptr<const Material> material = look_of(given_material, color, opacity, name);
    if (faces.is_none())
        return converted_mesh(vertices, normals, colors, std::move(material), values, std::move(values_name));
    std::vector<glm::dvec3> vertex_list = as_vectors(vertices, "vertices");
    std::vector<glm::dvec3> normal_list = as_vertex_vectors(normals, "normals", vertex_list.size());
    std::vector<glm::dvec3> color_list = as_vertex_colors(colors, vertex_list.size());
    VertexValues vertex_values = as_vertex_values(values, std::move(values_name), vertex_list.size());

    const py::array indices = as_array(faces, "faces", "iu", "an array of integers");
    if (indices.ndim() != 2 || indices.shape(1) != 3)
        throw_invalid("faces", "shape (F, 3)", to_text(shape_of(indices)));
    check_count("faces", static_cast<std::uint64_t>(indices.shape(0)));
    const py::array_t<std::int64_t, py::array::c_style | py::array::forcecast> rows(indices);
    const std::int64_t* const corners = rows.data();
    std::vector<glm::uvec3> face_list(static_cast<std::size_t>(rows.shape(0)));
    std::shared_ptr<Mesh> mesh;
    long_call("to make a mesh of " + std::to_string(face_list.size()) + " faces", py::none(), [&](const Progress&) {
        for (std::size_t i = 0; i < face_list.size(); ++i)
            for (int corner = 0; corner < 3; ++corner) {
                const std::int64_t index = corners[3 * i + static_cast<std::size_t>(corner)];
                if (index < 0 || index >= static_cast<std::int64_t>(vertex_list.size()))
                    throw_invalid("faces", "vertex indices from 0 to " + std::to_string(vertex_list.size()) + " - 1",
                                  std::to_string(index) + " in face " + std::to_string(i));
                face_list[i][corner] = static_cast<unsigned int>(index);
            }
        mesh = std::make_shared<Mesh>(std::move(vertex_list), std::move(face_list), std::move(normal_list),
                                      std::move(color_list), std::move(material), std::move(vertex_values));
    });
    return mesh;
}

} // namespace

void bind_mesh(py::module_& module)
{
    py::class_<Mesh, std::shared_ptr<Mesh>> mesh_class(module, "Mesh");
    mesh_class.def(py::init(&make_mesh))
        .def_property_readonly("material", [](const Mesh& self) { return material_in_python(self.material()); })
        .def_property_readonly("vertices",
                               [](const py::object& self) {
                                   const auto& vertices = self.cast<const Mesh&>().vertices();
                                   return read_only(
                                       py::array_t<double>({static_cast<py::ssize_t>(vertices.size()), py::ssize_t{3}},
                                                           reinterpret_cast<const double*>(vertices.data()), self));
                               })
        .def_property_readonly("faces",
                               [](const py::object& self) {
                                   const auto& faces = self.cast<const Mesh&>().faces();
                                   return read_only(py::array_t<std::uint32_t>(
                                       {static_cast<py::ssize_t>(faces.size()), py::ssize_t{3}},
                                       reinterpret_cast<const std::uint32_t*>(faces.data()), self));
                               })
        .def_property_readonly(
            "normals", [](const py::object& self) { return view_or_none(self, self.cast<const Mesh&>().normals()); })
        .def_property_readonly("colors",
                               [](const py::object& self) -> py::object {
                                   const py::object linear = view_or_none(self, self.cast<const Mesh&>().colors());
                                   return linear.is_none() ? linear : handed("encoded")(linear);
                               })
        .def("_colors",
             [](const py::object& self) -> py::object {
                 const py::object linear = view_or_none(self, self.cast<const Mesh&>().colors());
                 return linear.is_none() ? linear : handed("linear")(linear);
             })
        .def_property_readonly(
            "values",
            [](const py::object& self) -> py::object {
                const auto& numbers = self.cast<const Mesh&>().values().numbers;
                if (numbers.empty())
                    return py::none();
                return read_only(py::array_t<double>(static_cast<py::ssize_t>(numbers.size()), numbers.data(), self));
            })
        .def_property_readonly("values_name", [](const Mesh& mesh) { return mesh.values().name; })
        .def_property_readonly("bounds", [](const Mesh& mesh) { return to_array(mesh.bounds()); })
        .def("__repr__", [](const Mesh& mesh) {
            return "Mesh(" + std::to_string(mesh.vertices().size()) + " vertices, " +
                   std::to_string(mesh.faces().size()) + " faces)";
        });
}

} // namespace isospline
