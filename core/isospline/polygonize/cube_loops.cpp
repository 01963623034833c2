#include "isospline/polygonize/cube_loops.h"

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <vector>

namespace isospline {

namespace {

constexpr CubeEdge no_edge = 0xff;

/// For each crossed edge, the next one in its loop.
using Successors = std::array<CubeEdge, 64>;

CubeEdge edge_between(int a, int b)
{
    return cube_edge(std::min(a, b), std::max(a, b));
}

/// Links the crossed edges of a polygon of a cube's face, whose corners are counter-clockwise from outside.
///
/// The polygon's part in the solid is bounded, counter-clockwise, by a piece of the polygon's boundary, from the point
/// where it enters the solid to the point where it leaves, and by the surface, back to the first point. The surface's
/// loop has the opposite direction there: from the first point to the second.
void link(Successors& next, std::initializer_list<int> corners, unsigned solid, bool joined)
{
    const auto count = static_cast<int>(corners.size());
    const auto corner = [&](int i) { return corners.begin()[(i + count) % count]; };
    const auto is_in = [&](int i) { return (solid >> corner(i) & 1u) != 0; };
    for (int i = 0; i < count; ++i) {
        if (is_in(i - 1) || !is_in(i))
            continue;
        int leaving = i;
        if (joined) // around the outside corner
            for (leaving = i - 2; !is_in(leaving);)
                --leaving;
        else
            while (is_in(leaving + 1))
                ++leaving;
        next[edge_between(corner(i - 1), corner(i))] = edge_between(corner(leaving), corner(leaving + 1));
    }
}

} // namespace

std::array<int, 4> corners_of_face(int face)
{
    const int axis = face % 3, at = face < 3 ? 0 : 1 << axis;
    const int first = 1 << (axis + 1) % 3, second = 1 << (axis + 2) % 3;
    if (face < 3)
        return {at, at + second, at + first + second, at + first};
    return {at, at + first, at + first + second, at + second};
}

CubeLoops::CubeLoops(unsigned solid, unsigned joined, unsigned split)
{
    Successors next;
    next.fill(no_edge);
    for (int face = 0; face < 6; ++face) {
        const auto [a, b, c, d] = corners_of_face(face);
        if (split >> face & 1u) {
            link(next, {a, b, c}, solid, false);
            link(next, {a, c, d}, solid, false);
        } else {
            link(next, {a, b, c, d}, solid, (joined >> face & 1u) != 0);
        }
    }
    std::uint8_t size = 0;
    for (std::size_t first = 0; first < next.size(); ++first) {
        if (next[first] == no_edge)
            continue;
        for (auto edge = static_cast<CubeEdge>(first); next[edge] != no_edge;) {
            edges_[size++] = edge;
            const CubeEdge after = next[edge];
            next[edge] = no_edge;
            edge = after;
        }
        ends_[count_++] = size;
    }
}

unsigned CubeLoops::ambiguous_faces(unsigned solid)
{
    unsigned faces = 0;
    for (int face = 0; face < 6; ++face) {
        const auto [a, b, c, d] = corners_of_face(face);
        const unsigned in_a = solid >> a & 1u, in_b = solid >> b & 1u, in_c = solid >> c & 1u, in_d = solid >> d & 1u;
        faces |= static_cast<unsigned>(in_a == in_c && in_b == in_d && in_a != in_b) << face;
    }
    return faces;
}

const CubeLoops& CubeLoops::of(unsigned solid, unsigned joined)
{
    static const std::vector<CubeLoops> table = [] {
        std::vector<CubeLoops> loops;
        loops.reserve(std::size_t{256} * 64);
        for (unsigned joined_faces = 0; joined_faces < 64; ++joined_faces)
            for (unsigned solid_corners = 0; solid_corners < 256; ++solid_corners)
                loops.emplace_back(solid_corners, joined_faces & ambiguous_faces(solid_corners), 0u);
        return loops;
    }();
    return table[solid + 256 * std::size_t{joined}];
}

} // namespace isospline
