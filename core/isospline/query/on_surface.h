// The test of whether an approximate zero of f - level is on the surface: the boundary of the set where f < level.
#pragma once

#include "isospline/cell/coefficients.h"
#include "isospline/cell/value-inl.h"
#include "isospline/query/surface_descent.h"
#include "isospline/spline/volume.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace isospline {

namespace detail {

/// f - level of degree 1 about a point of the cell: sum over subsets S of the axes of c[S] times the product of d_i for
/// i in S. On a face (`side` is -1 or 1), d_i >= 0 points into the cell; elsewhere (0) it has both signs.
inline std::array<double, 8> expansion_about(const CellCoefficients& cell, const glm::dvec3& local,
                                             const glm::ivec3& side)
{
    std::array<double, 8> c;
    for (std::size_t corner = 0; corner < 8; ++corner)
        c[corner] = cell(corner & 1u, corner >> 1u & 1u, corner >> 2u);
    for (int axis = 0; axis < 3; ++axis)
        for (std::size_t lower = 0; lower < 8; ++lower) {
            const std::size_t upper = lower | std::size_t(1) << axis;
            if (lower == upper)
                continue;
            const double difference = c[upper] - c[lower];
            if (side[axis] > 0)
                c[lower] = c[upper];
            else if (side[axis] == 0)
                c[lower] += local[axis] * difference;
            c[upper] = side[axis] > 0 ? -difference : difference;
        }
    return c;
}

/// Whether an expansion without a constant is negative somewhere in each neighbourhood of the point.
///
/// Let S be minimal among the sets with c[S] != 0. Along d_i = e for i in S and 0 elsewhere, f - level is c[S] e^|S|;
/// its sign can be chosen if S has an axis where d_i has both signs. So a minimal set with c[S] < 0, or with such an
/// axis, proves the claim. Otherwise all minimal terms are positive. Each other term is that of a superset of a minimal
/// set, and near the point it is less than any part of the minimal one: nothing is negative.
inline bool is_negative_nearby(const std::array<double, 8>& c, const glm::ivec3& side)
{
    for (std::size_t set = 1; set < 8; ++set) {
        bool is_minimal = c[set] != 0.0, has_both_signs = false;
        for (std::size_t part = set & (set - 1u); part != 0 && is_minimal; part = (part - 1u) & set)
            is_minimal = c[part] == 0.0;
        for (int axis = 0; axis < 3; ++axis)
            has_both_signs |= (set >> axis & 1u) != 0 && side[axis] == 0;
        if (is_minimal && (has_both_signs || c[set] < 0.0))
            return true;
    }
    return false;
}

/// The least and the largest f - level of degree 1 at points of the cell whose coordinates differ from those of a point
/// by at most `reach`. f is linear along each axis, so both are at corners of that box.
inline std::array<double, 2> range_about(const CellCoefficients& cell, const glm::dvec3& local, double reach)
{
    const std::array<double, 8> c = expansion_about(cell, local, glm::ivec3(0));
    const glm::dvec3 lower = glm::max(-local, -reach), upper = glm::min(1.0 - local, reach);
    std::array<double, 2> range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    for (std::size_t corner = 0; corner < 8; ++corner) {
        std::array<double, 8> value = c;
        for (int axis = 2; axis >= 0; --axis)
            for (std::size_t i = 0; i < std::size_t(1) << axis; ++i)
                value[i] += ((corner >> axis & 1u) != 0 ? upper : lower)[axis] * value[i | std::size_t(1) << axis];
        range = {std::min(range[0], value[0]), std::max(range[1], value[0])};
    }
    return range;
}

/// The same question as below, for a point on or very near faces of its cell, at degree 1.
inline bool is_on_surface_at_face(const CellCoefficients& cell, const glm::dvec3& local, const glm::ivec3& side,
                                  double margin)
{
    // f is exact on the faces next to corners, edges and faces where it is the level.
    const std::array<double, 8> c = expansion_about(cell, local, side);
    if (c[0] == 0.0 && is_negative_nearby(c, side))
        return true;
    double magnitude = 0.0;
    for (std::size_t corner = 0; corner < 8; ++corner)
        magnitude = std::max(magnitude, std::abs(cell(corner & 1u, corner >> 1u & 1u, corner >> 2u)));
    const double rounding = 16.0 * 0x1p-53 * magnitude;
    const auto [least, most] = range_about(cell, local, margin);
    return least < -rounding && most > -rounding;
}

} // namespace detail

/// Whether a point of a cell, where a descent found f to be the level up to rounding, is on the surface: whether f is
/// less than the level somewhere near it in the cell, and not less somewhere else.
///
/// Zero counts as positive everywhere, so rays, boxes and meshes see no surface around a sample that equals the level
/// between larger ones. At degree 1, f has such minima on faces, edges and corners of its cells. Next to them f is
/// small for its gradient far from the surface: if f = x y near an edge, it is 1e-12 at a distance of 1e-6. So the
/// range of f within a small box decides there. A point that is refused although it is on the surface does no harm: the
/// search goes on in smaller boxes. At higher degrees f is smooth: it has such minima, besides points without a
/// gradient, only on the volume's border.
template <int Degree>
inline bool is_on_surface(const Volume& volume, const CellCoefficients& cell, const glm::dvec3& local)
{
    constexpr double margin = Degree == 1 ? 1e-8 : descent_margin;
    const glm::dvec3 last(volume.cell_shape() - 1);
    glm::ivec3 side(0);
    for (int axis = 0; axis < 3; ++axis) {
        if (local[axis] <= margin && (Degree == 1 || cell.lower[axis] == 0.0))
            side[axis] = -1;
        else if (local[axis] >= 1.0 - margin && (Degree == 1 || cell.lower[axis] == last[axis]))
            side[axis] = 1;
    }
    if (side == glm::ivec3(0))
        return true;
    if constexpr (Degree == 1)
        return detail::is_on_surface_at_face(cell, local, side, margin);
    const glm::dvec3 gradient = scalar::gradient_in_cell<Degree>(cell, local);
    for (int axis = 0; axis < 3; ++axis)
        if (side[axis] == 0 ? gradient[axis] != 0.0 : side[axis] * gradient[axis] > 0.0)
            return true;
    return false;
}

} // namespace isospline
