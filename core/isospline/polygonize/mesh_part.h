// Parts of a surface's mesh, and joining them.
#pragma once

#include "isospline/math/box.h"
#include "isospline/polygonize/lattice_field.h"
#include "isospline/util/progress.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

namespace isospline {

/// The key of a vertex that no other part has.
inline constexpr CrossingKey no_key = ~CrossingKey{0};

/// The part of the solid's boundary that a face is on: the isosurface, or the cap of plane `label - 1`.
using FaceLabel = std::uint32_t;
inline constexpr FaceLabel on_isosurface = 0;

/// Triangles with vertices in lattice space.
struct MeshPart {
    std::vector<glm::dvec3> vertices;
    std::vector<CrossingKey> keys; ///< one per vertex
    std::vector<glm::uvec3> faces;
    std::vector<FaceLabel> labels; ///< one per face, or empty if all faces are on the isosurface
};

/// Triangles that share vertices.
struct LabeledMesh {
    std::vector<glm::dvec3> vertices;
    std::vector<glm::uvec3> faces;
    std::vector<FaceLabel> labels; ///< one per face
};

/// An order of faces: by the numbers of their first, second and third corners.
inline bool is_face_before(const glm::uvec3& a, const glm::uvec3& b)
{
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

/// The corners of a triangle.
using Corners = std::array<glm::dvec3, 3>;

inline Corners corners_of(const std::vector<glm::dvec3>& vertices, const glm::uvec3& face)
{
    return {vertices[face.x], vertices[face.y], vertices[face.z]};
}

inline Corners corners_of(const LabeledMesh& mesh, std::size_t face)
{
    return corners_of(mesh.vertices, mesh.faces[face]);
}

inline Box box_of(const Corners& corners)
{
    return {glm::min(glm::min(corners[0], corners[1]), corners[2]),
            glm::max(glm::max(corners[0], corners[1]), corners[2])};
}

inline Box box_of(const std::vector<glm::dvec3>& vertices, const glm::uvec3& face)
{
    return box_of(corners_of(vertices, face));
}

/// For each vertex, whether a border of the mesh ends there. Around others, each neighbour is as often the second
/// corner of a face as the third one, so that numbers of the neighbours add up to zero. They do at a border with a
/// probability of 2^-64.
std::vector<std::uint8_t> vertices_at_borders(const LabeledMesh& mesh);

/// Joins parts: vertices with the same key are one. Vertices and faces are in the order of the parts.
LabeledMesh join_parts(std::vector<MeshPart> parts, const Progress& progress = {});

} // namespace isospline
