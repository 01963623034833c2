// A mesh whose edges can be collapsed, one after the other.
#pragma once

#include "isospline/polygonize/mesh_part.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace isospline {

/// Faces and labels of a manifold mesh. Collapses keep it one: they are those of H. Hoppe et al., "Mesh optimization",
/// SIGGRAPH 1993, that do not change its topology (the link condition). Lines along which labels change, and borders,
/// stay lines: their vertices move along them only, and stay where more than two such lines meet.
class EditableMesh {
public:
    EditableMesh(std::size_t vertex_count, std::vector<glm::uvec3> faces, std::vector<FaceLabel> labels);

    const std::vector<glm::uvec3>& faces() const { return faces_; }
    const std::vector<FaceLabel>& labels() const { return labels_; }
    /// Of faces that are left.
    bool is_alive(std::uint32_t face) const { return faces_[face].x != faces_[face].y; }
    /// The faces at a vertex. Good until the next call or collapse.
    std::span<const std::uint32_t> faces_of(std::uint32_t vertex) const;
    /// Whether the vertex `from` may become `to`, its neighbour.
    bool can_collapse(std::uint32_t from, std::uint32_t to) const;
    void collapse(std::uint32_t from, std::uint32_t to);
    /// Faces that are left, with their labels.
    void take(std::vector<glm::uvec3>& faces, std::vector<FaceLabel>& labels) &&;

private:
    /// The other end of an edge at a vertex.
    struct Neighbor {
        std::uint32_t vertex;
        std::uint32_t face_count;
        FaceLabel label;
        bool is_line; ///< a border, or between different labels
    };

    void find_neighbors(std::uint32_t vertex, std::vector<Neighbor>& neighbors) const;

    std::vector<glm::uvec3> faces_;
    std::vector<FaceLabel> labels_;
    // The corners at each vertex are a linked list; those of dead faces leave it when it is next walked.
    mutable std::vector<std::uint32_t> first_corner_, next_corner_;
    mutable std::vector<std::uint32_t> found_;
    mutable std::vector<Neighbor> around_from_, around_to_;
};

} // namespace isospline
