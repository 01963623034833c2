// Descent to the point of the surface that is locally the nearest to a given point: in one cell, or across cells. The
// surface is the boundary of the set where f < level.
#pragma once

#include "isospline/cell/coefficients.h"
#include "isospline/cell/jet.h"
#include "isospline/cell/value-inl.h"
#include "isospline/math/half_space.h"
#include "isospline/math/linear_system.h"
#include "isospline/query/lattice_metric.h"
#include "isospline/query/surface_box.h"
#include "isospline/spline/volume.h"
#include "isospline/trace/point_in_cell.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace isospline {

/// Points that a descent finds are in the cell and in the half-spaces up to this tolerance, in lattice units.
inline constexpr double descent_margin = 1e-11;

/// The result of a descent, in local coordinates of the cell.
struct DescentEnd {
    glm::dvec3 position;
    bool is_free; ///< not on the plane of a half-space
};

/// Newton's method on Lagrange's conditions for the least |L (x - point)|^2 / 2 with f(x) = level, from the middle
/// of a box, with steps of at most the box's size. Nothing if it does not end on the surface.
///
/// If the curvature of the surface would lead the Newton step to a maximum or a saddle, the step for a plane is taken.
/// A step that would leave a half-space ends on its plane, and the descent continues along the plane until the
/// multiplier changes sign. So minima on the faces of the cell and on cuts are found as well.
template <int Degree>
inline std::optional<DescentEnd> descend(const CellCoefficients& cell, const LatticeMetric& metric,
                                         const std::vector<HalfSpace>& half_spaces, const glm::dvec3& point,
                                         const SurfaceBox<Degree>& box)
{
    constexpr std::size_t capacity = 6;
    constexpr int iterations = 24, first_restoration = 20;
    const double scale = 1.0 / (metric.shortest_edge * metric.shortest_edge);
    const double longest_step = std::max({box.size.x, box.size.y, box.size.z});
    glm::dvec3 x = box.lower + 0.5 * box.size;
    double multiplier = 0.0;
    std::array<const HalfSpace*, 2> active{};
    std::size_t active_count = 0;
    for (int iteration = 0; iteration < iterations; ++iteration) {
        const Jet jet = jet_in_cell<Degree>(cell, x);
        const double slope = glm::length(jet.gradient);
        if (!(slope > 0.0))
            return std::nullopt;
        if (iteration == 0)
            multiplier = -scale * glm::dot(jet.gradient, metric.gram * (x - point)) / (slope * slope);

        // The unknowns are the step, the multiplier times the slope, and those of the planes.
        LinearSystem<capacity> system;
        const auto solve_step = [&](const glm::dmat3& quadratic, const glm::dvec3& pull) {
            system = {};
            for (int row = 0; row < 3; ++row) {
                const auto at = static_cast<std::size_t>(row);
                for (int column = 0; column < 3; ++column)
                    system[at][static_cast<std::size_t>(column)] = quadratic[column][row];
                system[at][3] = system[3][at] = jet.gradient[row] / slope;
                for (std::size_t plane = 0; plane < active_count; ++plane)
                    system[at][4 + plane] = system[4 + plane][at] = active[plane]->normal[row];
                system[at][capacity] = pull[row];
            }
            system[3][capacity] = -jet.value / slope;
            for (std::size_t plane = 0; plane < active_count; ++plane)
                system[4 + plane][capacity] = active[plane]->offset - glm::dot(active[plane]->normal, x);
            return solve(system, 4 + active_count, 1e-12);
        };
        const auto step_of_solution = [&] {
            return glm::dvec3(system[0][capacity], system[1][capacity], system[2][capacity]);
        };

        // The last steps only return to the surface.
        const bool restores = iteration >= first_restoration;
        const glm::dmat3 flat = scale * metric.gram, curved = flat + multiplier * jet.hessian;
        const glm::dvec3 pull = restores ? glm::dvec3(0.0) : scale * (metric.gram * (point - x));
        bool solved = !restores && solve_step(curved, pull);
        if (solved) {
            const glm::dvec3 along =
                step_of_solution() + (jet.value / (slope * slope)) * jet.gradient; // approximately in the tangent plane
            solved = glm::dot(along, curved * along) >= 0.0;
        }
        if (!solved && !solve_step(flat, pull))
            return std::nullopt;

        // Drop active constraints whose multipliers are negative.
        const auto holds = [&](std::size_t plane) { return system[4 + plane][capacity] <= 1e-12; };
        if (!restores && active_count > 0 && iteration < first_restoration / 2) {
            const std::size_t before = active_count;
            std::size_t kept = 0;
            for (std::size_t plane = 0; plane < before; ++plane)
                if (holds(plane))
                    active[kept++] = active[plane];
            if (kept < before) {
                active_count = kept;
                std::fill(active.begin() + static_cast<std::ptrdiff_t>(kept), active.end(), nullptr);
                continue;
            }
        }
        glm::dvec3 step = step_of_solution();
        const double length = glm::length(step);
        if (!std::isfinite(length))
            return std::nullopt;
        if (length > longest_step)
            step *= longest_step / length;

        // The largest part of the step that stays in all half-spaces.
        double part = 1.0;
        const HalfSpace* met = nullptr;
        for (const HalfSpace& half_space : half_spaces) {
            const double room = std::max(glm::dot(half_space.normal, x) - half_space.offset, 0.0);
            const double speed = -glm::dot(half_space.normal, step);
            if (part * speed > room + 0.5 * descent_margin && &half_space != active[0] && &half_space != active[1]) {
                part = room / speed;
                met = &half_space;
            }
        }
        x += part * step;
        if (met != nullptr) {
            if (active_count == active.size())
                return std::nullopt;
            active[active_count++] = met;
            continue;
        }
        multiplier = system[3][capacity] / slope;
        if (length < 1e-13 || (iteration > 12 && length < 1e-9))
            break;
    }

    // The result need not be the nearest point, but it must be on the surface.
    const double residual = scalar::value_in_cell<Degree>(cell, x);
    if (!(std::abs(residual) <= descent_margin * glm::length(scalar::gradient_in_cell<Degree>(cell, x))))
        return std::nullopt;
    for (const HalfSpace& half_space : half_spaces)
        if (glm::dot(half_space.normal, x) < half_space.offset - descent_margin)
            return std::nullopt;
    return DescentEnd{x, active_count == 0};
}

/// Some point of the surface in a box, between corners where f - level has opposite signs. Nothing if there are no such
/// corners, or if the point is not in all half-spaces.
template <int Degree>
inline std::optional<DescentEnd> any_point(const CellCoefficients& cell, const std::vector<HalfSpace>& half_spaces,
                                           const SurfaceBox<Degree>& box)
{
    std::optional<glm::dvec3> below, above;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::ivec3 at(corner & 1, corner >> 1 & 1, corner >> 2);
        const double value = box.b[bernstein_item<Degree>(Degree * at.x, Degree * at.y, Degree * at.z)];
        (value < 0.0 ? below : above) = box.lower + glm::dvec3(at) * box.size;
    }
    if (!below || !above)
        return std::nullopt;
    const auto is_negative = [&](const glm::dvec3& x) { return scalar::value_in_cell<Degree>(cell, x) < 0.0; };
    if (!is_negative(*below) || is_negative(*above)) // rounding: the surface is at a corner
        return std::nullopt;
    // Bisection by the sign alone. A root finder may also return a zero where f does not change sign, such as a sample
    // that equals the level between larger ones.
    for (int halving = 0; halving < 50; ++halving) {
        const glm::dvec3 middle = 0.5 * (*below + *above);
        (is_negative(middle) ? below : above) = middle;
    }
    const glm::dvec3 x = *above;
    for (const HalfSpace& half_space : half_spaces)
        if (glm::dot(half_space.normal, x) < half_space.offset - descent_margin)
            return std::nullopt;
    return DescentEnd{x, false};
}

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

/// A point of the surface whose gradient points to, or away from, the given point.
struct Foot {
    glm::ivec3 cell;
    glm::dvec3 local;
    glm::dvec3 gradient_world;
    double distance;

    /// The foot for a point in lattice space at a place where f is the level. Nothing if the way to the point is not
    /// perpendicular to the surface, up to rounding, which a descent with short steps does not prove: where the
    /// gradient almost vanishes, multipliers are so large that all steps are short.
    static std::optional<Foot> at(const LatticeMetric& metric, const glm::dvec3& point, const glm::ivec3& cell,
                                  const glm::dvec3& local, const glm::dvec3& gradient_lattice)
    {
        constexpr double margin = 1e-7;
        const glm::dvec3 gradient = gradient_lattice * metric.to_lattice;
        const glm::dvec3 way = metric.to_world * (point - (glm::dvec3(cell) + local));
        const double slope = glm::length(gradient), distance = glm::length(way);
        const double beside = glm::length(glm::cross(gradient, way)); // slope times the distance from the normal
        if (!(slope > 0.0 && beside <= slope * (margin * distance + descent_margin * metric.shortest_edge)))
            return std::nullopt;
        return Foot{cell, local, gradient, distance};
    }
};

/// Newton's method on Lagrange's conditions, starting at the point itself, with steps of at most the edge of a cell.
/// Nothing if it does not end on the surface within the domain.
template <int Degree>
inline std::optional<Foot> find_foot(const IsosurfaceSnapshot& surface, const LatticeMetric& metric,
                                     const glm::dvec3& point)
{
    constexpr int iterations = 16;
    const glm::dvec3 shape(surface.volume().cell_shape());
    const double scale = 1.0 / (metric.shortest_edge * metric.shortest_edge);
    const glm::dmat3 flat = scale * metric.gram, flat_inverse = glm::inverse(flat);
    glm::dvec3 x = glm::clamp(point, glm::dvec3(0.0), shape);
    double multiplier = 0.0;
    for (int iteration = 0; iteration < iterations; ++iteration) {
        const PointInCell at(surface, x);
        const Jet jet = jet_in_cell<Degree>(at.cell, at.local);
        const glm::dvec3 pull = flat * (point - x);
        const auto step_by = [&](const glm::dmat3& inverse, double& next_multiplier) {
            const glm::dvec3 of_gradient = inverse * jet.gradient, of_pull = inverse * pull;
            next_multiplier = (glm::dot(jet.gradient, of_pull) + jet.value) / glm::dot(jet.gradient, of_gradient);
            return of_pull - next_multiplier * of_gradient;
        };
        double next_multiplier = 0.0;
        glm::dvec3 step(0.0);
        bool solved = false;
        if (iteration > 0) {
            const glm::dmat3 curved = flat + multiplier * jet.hessian;
            step = step_by(glm::inverse(curved), next_multiplier);
            const glm::dvec3 along = step + jet.value / glm::dot(jet.gradient, jet.gradient) * jet.gradient;
            solved = glm::dot(along, curved * along) >= 0.0; // NaN: no
        }
        if (!solved)
            step = step_by(flat_inverse, next_multiplier);
        const double length = glm::length(step);
        if (!(length < 1e100))
            return std::nullopt;
        multiplier = next_multiplier;
        const glm::dvec3 before = x;
        x = glm::clamp(length > 1.0 ? x + step / length : x + step, glm::dvec3(0.0), shape);
        if (length > 1e-12) {
            if (x == before)
                return std::nullopt; // blocked by the border of the domain
            continue;
        }

        // It is on the surface, and it is the foot of a perpendicular.
        const PointInCell end(surface, x);
        const auto [value, gradient] = scalar::value_and_gradient_in_cell<Degree>(end.cell, end.local);
        const glm::dvec3 slope(gradient[0], gradient[1], gradient[2]);
        if (!(std::abs(value) <= descent_margin * glm::length(slope)))
            return std::nullopt;
        return Foot::at(metric, point, end.index, end.local, slope);
    }
    return std::nullopt;
}

} // namespace isospline
