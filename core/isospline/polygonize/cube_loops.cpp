#include "isospline/polygonize/cube_loops.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
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

constexpr std::size_t most_vertices = 18;
constexpr double forbidden = std::numeric_limits<double>::infinity();

/// Triangulations of the polygons that diagonals cut off, from small ones to the whole loop.
class Triangulation {
public:
    Triangulation(std::span<const CubeEdge> loop, std::span<const glm::dvec3> positions) : size_(loop.size())
    {
        for (std::size_t first = 0; first + 1 < size_; ++first)
            cost_[first][first + 1] = 0.0;
        for (std::size_t length = 2; length < size_; ++length)
            for (std::size_t first = 0; first + length < size_; ++first) {
                const std::size_t last = first + length;
                double least = forbidden;
                for (std::size_t middle = first + 1; middle < last; ++middle)
                    if (const double cost = cost_[first][middle] + cost_[middle][last]; cost < least) {
                        least = cost;
                        apex_[first][last] = static_cast<std::uint8_t>(middle);
                    }
                const bool is_diagonal = length + 1 < size_;
                if (is_diagonal && (faces_of(loop[first]) & faces_of(loop[last])) != 0)
                    least = forbidden;
                else if (is_diagonal) {
                    const glm::dvec3 difference = positions[last] - positions[first];
                    least += glm::dot(difference, difference);
                }
                cost_[first][last] = least;
            }
    }

    bool exists() const { return cost_[0][size_ - 1] < forbidden; }

    void append(LoopTriangles& triangles) const { append(triangles, 0, size_ - 1); }

private:
    void append(LoopTriangles& triangles, std::size_t first, std::size_t last) const
    {
        if (last - first < 2)
            return;
        const std::size_t apex = apex_[first][last];
        triangles.push_back(
            {static_cast<std::uint8_t>(first), static_cast<std::uint8_t>(apex), static_cast<std::uint8_t>(last)});
        append(triangles, first, apex);
        append(triangles, apex, last);
    }

    std::size_t size_;
    double cost_[most_vertices][most_vertices];
    std::uint8_t apex_[most_vertices][most_vertices] = {};
};

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

bool triangulate_loop(std::span<const CubeEdge> loop, std::span<const glm::dvec3> positions, LoopTriangles& triangles)
{
    triangles.clear();
    if (loop.size() == 3) {
        triangles.push_back({0, 1, 2});
        return true;
    }
    const Triangulation best(loop, positions);
    if (!best.exists())
        return false;
    best.append(triangles);
    return true;
}

} // namespace isospline
