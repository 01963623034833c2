#include "isospline/scene/mesh.h"

#include "isospline/util/check.h"

#include <cmath>
#include <string>

namespace isospline {

namespace {

/// Checks that an attribute has one entry per vertex or is empty.
void check_one_per_vertex(const char* parameter, std::size_t count, std::size_t vertex_count)
{
    if (count != 0 && count != vertex_count)
        throw_invalid(parameter, "one for each of the " + std::to_string(vertex_count) + " vertices", count);
}

void check_attribute(const char* parameter, const std::vector<glm::dvec3>& values, std::size_t vertex_count)
{
    check_one_per_vertex(parameter, values.size(), vertex_count);
    for (std::size_t i = 0; i < values.size(); ++i)
        if (!is_finite(values[i]))
            throw_invalid(parameter, "finite numbers", to_text(values[i]) + " at vertex " + std::to_string(i));
}

} // namespace

Mesh::Mesh(std::vector<glm::dvec3> vertices, std::vector<glm::uvec3> faces, std::vector<glm::dvec3> normals,
           std::vector<glm::dvec3> colors, std::shared_ptr<const Material> material, VertexValues values)
    : vertices_(std::move(vertices)), faces_(std::move(faces)), normals_(std::move(normals)),
      colors_(std::move(colors)), material_(std::move(material)), values_(std::move(values))
{
    check_count("vertices", vertices_.size());
    check_count("faces", faces_.size());
    check_attribute("normals", normals_, vertices_.size());
    check_attribute("colors", colors_, vertices_.size());
    check_one_per_vertex("values", values_.numbers.size(), vertices_.size());
    for (const glm::dvec3& color : colors_)
        check_not_negative("colors", color);
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis)
            if (!std::isfinite(vertices_[i][axis]))
                throw_invalid("vertices", "finite numbers",
                              std::to_string(vertices_[i][axis]) + " in vertex " + std::to_string(i));
        bounds_.extend(vertices_[i]);
    }
    for (std::size_t i = 0; i < faces_.size(); ++i)
        for (int corner = 0; corner < 3; ++corner)
            if (faces_[i][corner] >= vertices_.size())
                throw_invalid("faces", "vertex indices below " + std::to_string(vertices_.size()),
                              std::to_string(faces_[i][corner]) + " in face " + std::to_string(i));
}

} // namespace isospline
