// Triangle meshes.
#pragma once

#include "isospline/math/box.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace isospline {

/// A triangle mesh. Immutable: any number of threads may read it.
class Mesh {
public:
    /// Throws std::invalid_argument for a vertex that is not finite and for a face that names a missing vertex.
    Mesh(std::vector<glm::dvec3> vertices, std::vector<glm::uvec3> faces);

    const std::vector<glm::dvec3>& vertices() const { return vertices_; }
    const std::vector<glm::uvec3>& faces() const { return faces_; }
    /// The box of all vertices; empty where there are none.
    const Box& bounds() const { return bounds_; }

private:
    std::vector<glm::dvec3> vertices_;
    std::vector<glm::uvec3> faces_;
    Box bounds_;
};

} // namespace isospline
