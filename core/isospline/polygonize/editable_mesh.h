// A mesh whose edges can be collapsed, one after the other, and the merging of vertices that nearly coincide.
#pragma once

#include "isospline/polygonize/mesh_part.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

namespace isospline {

/// Faces and labels of a manifold mesh. It remains a manifold: only collapses that do not change its topology are
/// allowed (the link condition of H. Hoppe et al., "Mesh optimization", SIGGRAPH 1993). Borders, and lines where labels
/// change, are kept: their vertices only move along them, and do not move if more than two such lines meet. No edge of
/// the isosurface connects vertices of one seam across it: it would be in the plane of the cap.
///
/// Threads may work on it at the same time, each with a workspace of its own, if none changes a face that has a vertex
/// in common with what another one reads or changes.
class EditableMesh {
public:
    /// The other end of an edge at a vertex.
    struct Neighbor {
        std::uint32_t vertex;
        std::uint32_t face_count;
        FaceLabel label;
        bool is_line; ///< a border, or between different labels
    };
    struct Workspace {
        std::vector<std::uint32_t> faces;
        std::vector<Neighbor> around_from, around_to;
        std::vector<FaceLabel> caps;
    };

    EditableMesh(std::size_t vertex_count, std::vector<glm::uvec3> faces, std::vector<FaceLabel> labels);

    const std::vector<glm::uvec3>& faces() const { return faces_; }
    const std::vector<FaceLabel>& labels() const { return labels_; }
    /// Whether a face has not been removed.
    bool is_alive(std::uint32_t face) const { return faces_[face].x != faces_[face].y; }
    /// The faces at a vertex. Valid until the next call with this workspace.
    std::span<const std::uint32_t> faces_of(std::uint32_t vertex, Workspace& workspace);
    /// Whether the vertex `from` may be collapsed into its neighbour `to`.
    bool can_collapse(std::uint32_t from, std::uint32_t to, Workspace& workspace);
    void collapse(std::uint32_t from, std::uint32_t to);
    /// The remaining faces, with their labels.
    std::pair<std::vector<glm::uvec3>, std::vector<FaceLabel>> take() &&;

private:
    void find_neighbors(std::uint32_t vertex, std::vector<Neighbor>& neighbors, Workspace& workspace);
    bool makes_chord(std::uint32_t to, Workspace& workspace);

    std::vector<glm::uvec3> faces_;
    std::vector<FaceLabel> labels_;
    // The corners at each vertex are a linked list; corners of removed faces are unlinked at the next traversal.
    std::vector<std::uint32_t> first_corner_, next_corner_;
};

/// Collapses edges that are shorter than `distance`, in lattice units, if the mesh remains a manifold and no face is
/// flipped. Such edges come from nodes of the lattice almost on the surface, and degenerate in single precision
/// formats. Vertices for which `stays` returns true are kept.
void merge_close_vertices(LabeledMesh& mesh, double distance, const std::function<bool(const glm::dvec3&)>& stays = {});

/// Removes vertices without faces. Returns the numbers that the others had.
std::vector<std::uint32_t> drop_unused_vertices(LabeledMesh& mesh);

} // namespace isospline
