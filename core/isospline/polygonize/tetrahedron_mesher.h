// The mesh of an isosurface, and of its caps, in cubes that are split into tetrahedra.
#pragma once

#include "isospline/polygonize/cells_in_question.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/special_cubes.h"
#include "isospline/polygonize/tetrahedron.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tuple>
#include <unordered_map>
#include <vector>

namespace isospline {

/// Meshes special cubes.
///
/// Each cube is split into six tetrahedra around its diagonal (Kuhn). Where the mesh would be too coarse, edges are
/// halved, the longest first. Then the solid's planes cut the tetrahedra, by the signs at corners, and the rest is
/// marched by the signs of f - level. Tetrahedra treat a shared face identically, so the mesh is a manifold for all
/// signs, and vertices where a cap meets the surface are on both.
template <int Degree>
class TetrahedronMesher {
public:
    TetrahedronMesher(const LatticeField<Degree>& field, SpecialCubes& cubes) : field_(field), cubes_(cubes) {}

    /// Adds the cubes that planes cut and that contain surface or, if there are caps, solid, in the cells that a filter
    /// selects.
    void add_cut_cubes(const CellFilter& filter, const Progress& progress);
    /// Adds the cubes that these boxes, in lattice space, meet, and halves edges until, in each tetrahedron that meets
    /// a box and may contain surface, no edge is longer than `longest_allowed` or than 1/32 of a cell.
    void refine(const std::vector<Box>& boxes, double longest_allowed, const Progress& progress);
    /// The mesh of the tetrahedra in the cells that a filter selects.
    MeshPart march(const CellFilter& filter, const Progress& progress);

private:
    /// An edge, by the numbers of its ends, the smaller first.
    using EdgeId = std::uint64_t;
    using Nodes = std::unordered_map<EdgeId, NodeId>;

    struct Node {
        glm::dvec3 position;
        bool is_solid;
        bool is_of_lattice;
    };
    struct SplitCube {
        glm::ivec3 at; ///< its lower corner
        std::vector<Tetrahedron> tetrahedra;
    };

    /// Nodes of the lattice come first. Then, the order is that of places, so that it does not depend on which cubes
    /// were added before.
    bool is_before(NodeId a, NodeId b) const
    {
        const Node &first = nodes_[a], &second = nodes_[b];
        if (first.is_of_lattice != second.is_of_lattice)
            return first.is_of_lattice;
        const glm::dvec3 &at_first = first.position, &at_second = second.position;
        return std::tie(at_first.x, at_first.y, at_first.z, a) < std::tie(at_second.x, at_second.y, at_second.z, b);
    }
    static EdgeId edge_id(NodeId a, NodeId b) { return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b); }

    /// Returns the number of the cube.
    std::uint32_t add_cube(const glm::ivec3& cube);
    std::optional<std::uint32_t> split_cube(const glm::ivec3& cube);
    NodeId lattice_node(const glm::ivec3& node);
    NodeId add_node(const glm::dvec3& position, bool is_of_lattice);

    bool is_too_coarse(const Tetrahedron& corners, double longest_allowed, const std::vector<Box>& boxes) const;
    /// The longest edge; among equal ones, the choice is the same for all tetrahedra that share them.
    EdgeId longest_edge(const Tetrahedron& corners, const Nodes* among) const;
    /// Adds the numbers of the cubes that share the edge to `touched`.
    void halve(EdgeId edge, Nodes& middles, std::vector<std::uint32_t>& touched);
    void split(const Tetrahedron& corners, const Nodes& middles, std::vector<Tetrahedron>& parts) const;

    double distance(const HalfSpace& half_space, NodeId node) const
    {
        return glm::dot(half_space.normal, nodes_[node].position) - half_space.offset;
    }
    int side(const HalfSpace& half_space, NodeId node) const
    {
        const double above = distance(half_space, node);
        return above > plane_margin ? 1 : above < -plane_margin ? -1 : 0;
    }
    NodeId cut(const HalfSpace& half_space, NodeId inner, NodeId outer);
    void clip_and_march(const Tetrahedron& corners);
    std::uint32_t add_vertex(const glm::dvec3& position, CrossingKey key);
    std::uint32_t vertex(NodeId node);
    std::uint32_t crossing(NodeId a, NodeId b);
    void add_face(std::uint32_t a, std::uint32_t b, std::uint32_t c, FaceLabel label);
    void march(Tetrahedron corners);
    void add_caps(const Tetrahedron& corners);

    const LatticeField<Degree>& field_;
    SpecialCubes& cubes_;
    std::vector<SplitCube> split_;
    std::unordered_map<CrossingKey, std::uint32_t> number_of_cube_;
    std::vector<Node> nodes_;
    std::unordered_map<CrossingKey, NodeId> lattice_nodes_;
    Nodes cuts_;
    std::unordered_map<EdgeId, std::uint32_t> crossings_;
    std::unordered_map<NodeId, std::uint32_t> vertices_;
    std::vector<FaceLabel> cutting_; ///< planes that cut a tetrahedron
    std::vector<Tetrahedron> whole_, left_;
    MeshPart part_;
};

} // namespace isospline
