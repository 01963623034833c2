// Tetrahedra with numbered nodes as corners, and cutting them by a plane.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

namespace isospline {

using NodeId = std::uint32_t;

/// The corners a, b, c, d; det(b - a, c - a, d - a) is positive.
using Tetrahedron = std::array<NodeId, 4>;

/// The faces of a tetrahedron by their corners, counter-clockwise as seen from outside.
inline constexpr std::array<std::array<std::size_t, 3>, 4> tetrahedron_faces{
    {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

/// Sorts the corners by a rank, the highest first, and keeps the tetrahedron's orientation. Ranks may
/// be equal.
template <typename Rank>
void sort_corners(Tetrahedron& tetrahedron, const Rank& rank)
{
    bool is_odd = false;
    for (std::size_t end = 3; end > 0; --end)
        for (std::size_t i = 0; i < end; ++i)
            if (rank(tetrahedron[i]) < rank(tetrahedron[i + 1])) {
                std::swap(tetrahedron[i], tetrahedron[i + 1]);
                is_odd = !is_odd;
            }
    for (std::size_t i = 0; is_odd; ++i)
        if (rank(tetrahedron[i]) == rank(tetrahedron[i + 1])) {
            std::swap(tetrahedron[i], tetrahedron[i + 1]);
            is_odd = false;
        }
}

/// Calls `visit` with the three tetrahedra of a prism whose edges lead from `lower[i]` to `upper[i]`. A
/// four-sided face is cut along the diagonal from its first node in the order `is_before`, so that prisms agree on the
/// faces they share (J. Dompierre et al., "How to subdivide pyramids, prisms and hexahedra into tetrahedra", 1999).
template <typename IsBefore, typename Visit>
void for_each_part_of_prism(std::array<NodeId, 3> lower, std::array<NodeId, 3> upper, const IsBefore& is_before,
                            const Visit& visit)
{
    const auto first_of = [&](NodeId a, NodeId b) { return is_before(b, a) ? b : a; };
    const auto first_of_all = [&](const std::array<NodeId, 3>& nodes) {
        return std::min_element(nodes.begin(), nodes.end(), is_before);
    };
    if (is_before(*first_of_all(upper), *first_of_all(lower))) {
        std::swap(lower, upper); // upside down; a reflection keeps the orientation
        std::swap(lower[1], lower[2]);
        std::swap(upper[1], upper[2]);
    }
    const auto first = first_of_all(lower) - lower.begin();
    std::rotate(lower.begin(), lower.begin() + first, lower.end());
    std::rotate(upper.begin(), upper.begin() + first, upper.end());
    if (is_before(first_of(lower[1], upper[2]), first_of(lower[2], upper[1]))) {
        visit(Tetrahedron{lower[0], lower[1], lower[2], upper[2]});
        visit(Tetrahedron{lower[0], lower[1], upper[2], upper[1]});
    } else {
        visit(Tetrahedron{lower[0], lower[1], lower[2], upper[1]});
        visit(Tetrahedron{lower[0], upper[1], lower[2], upper[2]});
    }
    visit(Tetrahedron{lower[0], upper[1], upper[2], upper[0]});
}

/// Calls `visit` with the tetrahedra that a half-space keeps of one. `side(node)` is positive, zero or negative for
/// nodes inside, on the plane or outside; `cut(inner, outer)` is the node where the plane cuts an edge; `is_before` is
/// an order of nodes, the same for all tetrahedra.
template <typename Side, typename Cut, typename IsBefore, typename Visit>
void cut_tetrahedron(Tetrahedron corners, const Side& side, const Cut& cut, const IsBefore& is_before,
                     const Visit& visit)
{
    sort_corners(corners, side);
    const auto [a, b, c, d] = corners;
    const auto inner = std::count_if(corners.begin(), corners.end(), [&](NodeId node) { return side(node) > 0; });
    const auto to_plane = [&](NodeId node) { return side(node) < 0 ? cut(corners[0], node) : node; };
    if (inner == 0)
        return;
    if (side(d) >= 0) {
        visit(corners);
    } else if (inner == 1) {
        visit(Tetrahedron{a, to_plane(b), to_plane(c), to_plane(d)});
    } else if (inner == 3) {
        for_each_part_of_prism({a, b, c}, {cut(a, d), cut(b, d), cut(c, d)}, is_before, visit);
    } else if (side(c) < 0) {
        for_each_part_of_prism({a, cut(a, c), cut(a, d)}, {b, cut(b, c), cut(b, d)}, is_before, visit);
    } else { // a pyramid above c, which is on the plane
        const NodeId of_a = cut(a, d), of_b = cut(b, d);
        if (is_before(is_before(a, of_b) ? a : of_b, is_before(b, of_a) ? b : of_a)) {
            visit(Tetrahedron{a, c, of_a, of_b});
            visit(Tetrahedron{a, c, of_b, b});
        } else {
            visit(Tetrahedron{a, c, of_a, b});
            visit(Tetrahedron{b, c, of_a, of_b});
        }
    }
}

} // namespace isospline
