// Whether faces of a mesh meet elsewhere than at the vertices and edges that they share.
#pragma once

#include "isospline/polygonize/mesh_part.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace isospline {

/// Whether two faces meet elsewhere than at common vertices and edges, decided exactly. Touching counts as meeting.
/// Faces without area are represented by the faces around them.
bool faces_cross(const std::vector<glm::dvec3>& vertices, const glm::uvec3& first, const glm::uvec3& second);

/// Positions of the vertices in another space, where rounding lets other faces cross.
struct RoundedVertices {
    const std::vector<glm::dvec3>& vertices;
    glm::dvec3 error; ///< of each vertex in the first space, at most
};

/// The pairs of faces of a mesh that cross, in one of the spaces, by their numbers, sorted. If `is_examined` is not
/// empty, only those with a face for which it is not zero.
std::vector<std::array<std::uint32_t, 2>> find_crossings(const std::vector<glm::dvec3>& vertices,
                                                         const std::vector<glm::uvec3>& faces,
                                                         const std::vector<std::uint8_t>& is_examined = {},
                                                         const Progress& progress = {},
                                                         const RoundedVertices* rounded = nullptr);

} // namespace isospline
