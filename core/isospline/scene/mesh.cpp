#include "isospline/scene/mesh.h"

#include "isospline/util/error.h"

#include <cmath>
#include <string>

namespace isospline {

Mesh::Mesh(std::vector<glm::dvec3> vertices, std::vector<glm::uvec3> faces)
    : vertices_(std::move(vertices)), faces_(std::move(faces))
{
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
