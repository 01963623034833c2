// Triangle meshes.
#pragma once

#include "isospline/math/box.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <memory>
#include <vector>

namespace isospline {

struct Material;

/// A triangle mesh. Immutable: any number of threads may read it.
class Mesh {
public:
    /// `normals` and linear `colors` are one a vertex, or none; surfaces are shaded with what lies between them. The
    /// material, if any, is what path tracers take.
    /// Throws std::invalid_argument for 2^32 vertices or faces and more, a vertex that is not finite, a face that names
    /// a missing vertex, normals and colours that are not finite or not as many as vertices, and a negative colour.
    Mesh(std::vector<glm::dvec3> vertices, std::vector<glm::uvec3> faces, std::vector<glm::dvec3> normals = {},
         std::vector<glm::dvec3> colors = {}, std::shared_ptr<const Material> material = nullptr);

    const std::vector<glm::dvec3>& vertices() const { return vertices_; }
    const std::vector<glm::uvec3>& faces() const { return faces_; }
    /// Of the vertices, outward, of any length; empty where there are none.
    const std::vector<glm::dvec3>& normals() const { return normals_; }
    /// Of the vertices, linear; empty where there are none.
    const std::vector<glm::dvec3>& colors() const { return colors_; }
    /// What it is made of, or nothing.
    const std::shared_ptr<const Material>& material() const { return material_; }
    /// The box of all vertices; empty where there are none.
    const Box& bounds() const { return bounds_; }

private:
    std::vector<glm::dvec3> vertices_;
    std::vector<glm::uvec3> faces_;
    std::vector<glm::dvec3> normals_, colors_;
    std::shared_ptr<const Material> material_;
    Box bounds_;
};

} // namespace isospline
