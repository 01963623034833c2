// Triangle meshes.
#pragma once

#include "isospline/math/box.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace isospline {

struct Material;

/// A number at each vertex of a mesh, such as a temperature; NaN where it is unknown.
struct VertexValues {
    std::vector<double> numbers;
    std::string name = "values"; ///< the title of colour bars; for files and other programs, too
};

/// A triangle mesh. Immutable: any number of threads may read it.
class Mesh {
public:
    /// `normals` and linear `colors` have one entry per vertex or are empty; they are interpolated across each face.
    /// Path tracers use the material, if there is one. `values` have one number per vertex or none; `ColorByValue`
    /// shows them. Throws std::invalid_argument for 2^32 or more vertices or faces, a vertex that is not finite, a face
    /// that refers to a missing vertex, and a negative colour. Also throws it if normals or colours are not finite or
    /// their number differs from the number of vertices, or if the number of values does.
    Mesh(std::vector<glm::dvec3> vertices, std::vector<glm::uvec3> faces, std::vector<glm::dvec3> normals = {},
         std::vector<glm::dvec3> colors = {}, std::shared_ptr<const Material> material = nullptr,
         VertexValues values = {});

    const std::vector<glm::dvec3>& vertices() const { return vertices_; }
    const std::vector<glm::uvec3>& faces() const { return faces_; }
    /// Vertex normals, outward, of any length; may be empty.
    const std::vector<glm::dvec3>& normals() const { return normals_; }
    /// Linear vertex colours; may be empty.
    const std::vector<glm::dvec3>& colors() const { return colors_; }
    /// The material for path tracers, or null.
    const std::shared_ptr<const Material>& material() const { return material_; }
    const VertexValues& values() const { return values_; }
    /// The box of all vertices; empty if there are none.
    const Box& bounds() const { return bounds_; }

private:
    std::vector<glm::dvec3> vertices_;
    std::vector<glm::uvec3> faces_;
    std::vector<glm::dvec3> normals_, colors_;
    std::shared_ptr<const Material> material_;
    VertexValues values_;
    Box bounds_;
};

} // namespace isospline
