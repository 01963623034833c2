// The test of whether a zero of f - level belongs to the surface: the boundary of the set where f < level.
#pragma once

#include "isospline/cell/coefficients.h"
#include "isospline/cell/value-inl.h"
#include "isospline/query/surface_descent.h"
#include "isospline/spline/volume.h"

#include <glm/vec3.hpp>

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>

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

} // namespace detail

/// Whether f < level somewhere in each neighbourhood, within the cell, of a point of the cell where f is the level.
///
/// Zero counts as positive everywhere, so rays, boxes and meshes see no surface around a sample that equals the level
/// between larger ones. At degree 1, f has such minima on faces, edges and corners of its cells, and the result is
/// exact. At higher degrees f is smooth: it has them, besides points without a gradient, only on the volume's border.
template <int Degree>
inline bool has_negative_side(const Volume& volume, const CellCoefficients& cell, const glm::dvec3& local)
{
    const glm::dvec3 last(volume.cell_shape() - 1);
    glm::ivec3 side(0);
    for (int axis = 0; axis < 3; ++axis) {
        if (local[axis] <= descent_margin && (Degree == 1 || cell.lower[axis] == 0.0))
            side[axis] = -1;
        else if (local[axis] >= 1.0 - descent_margin && (Degree == 1 || cell.lower[axis] == last[axis]))
            side[axis] = 1;
    }
    if (side == glm::ivec3(0))
        return true;
    if constexpr (Degree == 1) {
        const std::array<double, 8> c = detail::expansion_about(cell, local, side);
        return c[0] != 0.0 || detail::is_negative_nearby(c, side);
    } else {
        const glm::dvec3 gradient = scalar::gradient_in_cell<Degree>(cell, local);
        for (int axis = 0; axis < 3; ++axis)
            if (side[axis] == 0 ? gradient[axis] != 0.0 : side[axis] * gradient[axis] > 0.0)
                return true;
        return false;
    }
}

} // namespace isospline
