// The course of the surface through one cube, from the signs at its corners: closed loops of crossed edges,
// and their triangulation.
#pragma once

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace isospline {

/// The corners of a cube are 0 to 7: bits 0, 1, 2 are their place along x, y, z. An edge, or a diagonal of a face, is
/// numbered 8 * its lower corner + the corner's bits that change.
using CubeEdge = std::uint8_t;

constexpr CubeEdge cube_edge(int lower, int upper)
{
    return static_cast<CubeEdge>(8 * lower + (upper - lower));
}
constexpr int lower_corner(CubeEdge edge)
{
    return edge >> 3;
}
constexpr int edge_direction(CubeEdge edge)
{
    return edge & 7;
}

/// The faces of a cube are 0 to 5: those across x, y, z at 0, then those at 1. Bit i of the mask: the edge is in face
/// i.
constexpr unsigned faces_of(CubeEdge edge)
{
    unsigned faces = 0;
    for (int axis = 0; axis < 3; ++axis)
        if ((edge_direction(edge) >> axis & 1) == 0)
            faces |= 1u << (axis + 3 * (lower_corner(edge) >> axis & 1));
    return faces;
}

/// The corners of a face, counter-clockwise as seen from outside of the cube; the first is the lowest.
std::array<int, 4> corners_of_face(int face);

/// Loops of crossed edges. Their orientation is counter-clockwise as seen from outside of the solid.
class CubeLoops {
public:
    /// Bit i of `solid`: corner i is in the solid. Bit i of `joined`: if the corners of face i alternate, those in the
    /// solid are joined across its middle; otherwise they are separate. Bit i of `split`: face i is two triangles,
    /// split along the diagonal from its lowest corner, so its signs are not ambiguous.
    CubeLoops(unsigned solid, unsigned joined, unsigned split);

    int count() const { return count_; }
    std::span<const CubeEdge> loop(int i) const
    {
        const std::size_t begin = i > 0 ? ends_[static_cast<std::size_t>(i) - 1] : 0u;
        return {edges_.data() + begin, ends_[static_cast<std::size_t>(i)] - begin};
    }

    /// Faces whose corners alternate: bit i for face i.
    static unsigned ambiguous_faces(unsigned solid);
    /// The loops if no face is split, from a table.
    static const CubeLoops& of(unsigned solid, unsigned joined);

private:
    std::array<CubeEdge, 18> edges_; // 12 edges, 6 diagonals: each is crossed once
    std::array<std::uint8_t, 6> ends_;
    std::uint8_t count_ = 0;
};

/// Triangles of positions in a loop.
using LoopTriangles = std::vector<std::array<std::uint8_t, 3>>;

/// Splits a loop into triangles by the diagonals with the smallest sum of squared lengths. No diagonal joins two edges
/// of one face of the cube: the cube behind that face might have the same diagonal, and an edge of the mesh would have
/// four faces. False if there is no such triangulation; the loop then needs a vertex in its middle.
bool triangulate_loop(std::span<const CubeEdge> loop, std::span<const glm::dvec3> positions, LoopTriangles& triangles);

} // namespace isospline
