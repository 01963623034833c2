// A part of a cell with f - level on it, a slab around its surface, and a lower bound on the distance of the surface
// from a point.
#pragma once

#include "isospline/cell/coefficients.h"
#include "isospline/math/bernstein_box.h"
#include "isospline/math/half_space.h"
#include "isospline/query/lattice_metric.h"
#include "isospline/spline/cell_weights-inl.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace isospline {

/// The box lower + [0, 1]^3 * size of a cell.
template <int Degree>
struct SurfaceBox {
    BernsteinBox<Degree> b; ///< f - level on it
    glm::dvec3 lower, size; ///< local coordinates of the cell
    std::uint32_t row;      ///< of the cell, in Shell::cells()
    int depth;              ///< the number of times it was halved

    bool has_surface() const
    {
        const auto [least, most] = std::minmax_element(b.begin(), b.end());
        return *least < 0.0 && *most >= 0.0;
    }
};

/// The whole of a cell.
template <int Degree>
inline SurfaceBox<Degree> surface_box(const CellCoefficients& cell, std::uint32_t row)
{
    SurfaceBox<Degree> box{{}, glm::dvec3(0.0), glm::dvec3(1.0), row, 0};
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j)
            for (int i = 0; i <= Degree; ++i)
                box.b[bernstein_item<Degree>(i, j, k)] = cell(i, j, k);
    for (int axis = 0; axis < 3; ++axis)
        map_rows<Degree>(box.b, axis, [](Bernstein<Degree>& c) { c = scalar::bernstein_of_bspline<Degree>(c); });
    return box;
}

/// One half of a box, split along an axis.
template <int Degree>
inline SurfaceBox<Degree> half_of(const SurfaceBox<Degree>& box, int axis, bool upper)
{
    SurfaceBox<Degree> half{half_of<Degree>(box.b, axis, upper), box.lower, box.size, box.row, box.depth + 1};
    half.size[axis] *= 0.5;
    if (upper)
        half.lower[axis] += half.size[axis];
    return half;
}

/// The part of a cell from `lower` to `upper`, in local coordinates; `box` is the whole cell.
template <int Degree>
inline SurfaceBox<Degree> part_of_cell(SurfaceBox<Degree> box, const glm::dvec3& lower, const glm::dvec3& upper)
{
    constexpr std::size_t count = Degree + 1, total = count * count * count;
    std::size_t stride = 1; // from one coefficient along the axis to the next
    for (int axis = 0; axis < 3; ++axis, stride *= count) {
        // De Casteljau's algorithm: the part below the upper end, and of that, the part above the lower end.
        const double until = upper[axis], from = lower[axis] / upper[axis];
        for (double* row = box.b.data(); row != box.b.data() + total; row += stride * count) {
            if (until != 1.0)
                for (std::size_t round = 1; round <= Degree; ++round)
                    for (std::size_t i = Degree; i >= round; --i)
                        for (double* b = row + i * stride; b != row + (i + 1) * stride; ++b)
                            *b = (1.0 - until) * *(b - stride) + until * *b;
            if (from != 0.0)
                for (std::size_t round = 1; round <= Degree; ++round)
                    for (std::size_t i = 0; i + round <= Degree; ++i)
                        for (double* b = row + i * stride; b != row + (i + 1) * stride; ++b)
                            *b = (1.0 - from) * *b + from * *(b + stride);
        }
    }
    box.lower = lower;
    box.size = upper - lower;
    return box;
}

/// The points t of the unit cube with lower <= <normal, t> <= upper.
struct UnitSlab {
    glm::dvec3 normal;
    double lower, upper;
};

/// A slab that contains the surface in a box, in coordinates t of the box. As in brick/block.cpp: let l be the linear
/// function along the mean gradient; its Bernstein coefficients are its values at (i, j, k) / n. Then f - l lies
/// between the smallest and the largest difference of coefficients.
template <int Degree>
inline UnitSlab slab_of(const SurfaceBox<Degree>& box)
{
    constexpr int count = Degree + 1;
    UnitSlab slab{glm::dvec3(0.0), 0.0, 0.0};
    for (int j = 0; j < count; ++j)
        for (int i = 0; i < count; ++i) {
            slab.normal.x += box.b[bernstein_item<Degree>(Degree, i, j)] - box.b[bernstein_item<Degree>(0, i, j)];
            slab.normal.y += box.b[bernstein_item<Degree>(i, Degree, j)] - box.b[bernstein_item<Degree>(i, 0, j)];
            slab.normal.z += box.b[bernstein_item<Degree>(i, j, Degree)] - box.b[bernstein_item<Degree>(i, j, 0)];
        }
    slab.normal /= count * count;
    double least = std::numeric_limits<double>::infinity(), most = -least, largest = 0.0;
    for (int k = 0; k < count; ++k)
        for (int j = 0; j < count; ++j)
            for (int i = 0; i < count; ++i) {
                const double coefficient = box.b[bernstein_item<Degree>(i, j, k)];
                const double difference = coefficient - glm::dot(slab.normal, glm::dvec3(i, j, k)) / Degree;
                least = std::min(least, difference);
                most = std::max(most, difference);
                largest = std::max(largest, std::abs(coefficient));
            }
    const double rounding = 0x1p-46 * largest;
    slab.lower = -most - rounding;
    slab.upper = -least + rounding;
    return slab;
}

/// The smallest <cost, t> over a slab's points; infinite if it has none.
///
/// A linear program with one constraint: starting from the cheapest corner, coordinates move to their other end, in the
/// order of their cost per unit of <normal, t>, until the slab is reached.
inline double least_over(const UnitSlab& slab, const glm::dvec3& cost)
{
    glm::dvec3 corner(0.0);
    for (int axis = 0; axis < 3; ++axis)
        corner[axis] = cost[axis] < 0.0 ? 1.0 : 0.0;
    double total = std::min(cost.x, 0.0) + std::min(cost.y, 0.0) + std::min(cost.z, 0.0);
    const double at = glm::dot(slab.normal, corner);
    const double sign = at < slab.lower ? 1.0 : -1.0;
    double missing = at < slab.lower ? slab.lower - at : at - slab.upper;

    glm::dvec3 gain = sign * slab.normal * (1.0 - 2.0 * corner);
    while (missing > 0.0) {
        int cheapest = -1;
        for (int axis = 0; axis < 3; ++axis)
            if (gain[axis] > 0.0 &&
                (cheapest < 0 || std::abs(cost[axis]) * gain[cheapest] < std::abs(cost[cheapest]) * gain[axis]))
                cheapest = axis;
        if (cheapest < 0)
            return std::numeric_limits<double>::infinity();
        const double part = std::min(1.0, missing / gain[cheapest]);
        total += part * std::abs(cost[cheapest]);
        missing = part < 1.0 ? 0.0 : missing - gain[cheapest];
        gain[cheapest] = 0.0;
    }
    return total;
}

/// Points whose convex hull is the part of the unit cube in a slab.
inline void points_of_slab(const UnitSlab& slab, std::vector<glm::dvec3>& points)
{
    points.clear();
    for (int corner = 0; corner < 8; ++corner)
        for (int axis = 0; axis < 3; ++axis) {
            if ((corner >> axis & 1) != 0)
                continue;
            // The part of an edge of the cube.
            const glm::dvec3 from(corner & 1, corner >> 1 & 1, corner >> 2);
            const double at_begin = glm::dot(slab.normal, from), change = slab.normal[axis];
            double begin = 0.0, end = 1.0;
            if (change != 0.0) {
                const double first = (slab.lower - at_begin) / change, second = (slab.upper - at_begin) / change;
                begin = std::max(begin, std::min(first, second));
                end = std::min(end, std::max(first, second));
            } else if (at_begin < slab.lower || at_begin > slab.upper) {
                continue;
            }
            if (begin > end)
                continue;
            for (const double t : {begin, end}) {
                glm::dvec3 point = from;
                point[axis] += t;
                if (points.empty() || points.back() != point)
                    points.push_back(point);
            }
        }
}

/// Replaces points by ones whose convex hull is that of the points, cut by a half-space <normal, x> >= offset. Leaves
/// the points as they are, a larger hull, if there would be too many.
inline void clip_hull(std::vector<glm::dvec3>& points, const glm::dvec3& normal, double offset)
{
    constexpr std::size_t most = 64;
    std::vector<glm::dvec3> kept, outside;
    for (const glm::dvec3& point : points)
        (glm::dot(normal, point) >= offset ? kept : outside).push_back(point);
    if (outside.empty() || kept.size() * (outside.size() + 1) > most)
        return;
    const std::size_t inside_count = kept.size();
    for (std::size_t i = 0; i < inside_count; ++i)
        for (const glm::dvec3& point : outside) {
            const double above = glm::dot(normal, kept[i]) - offset, below = glm::dot(normal, point) - offset;
            kept.push_back(kept[i] + (above / (above - below)) * (point - kept[i]));
        }
    points.swap(kept);
}

/// A half-space relative to a point: the x with <normal, L (x - point)> >= offset; the normal has length one.
struct CutInWorld {
    glm::dvec3 normal;
    double offset;
};

/// A lower bound on the world distance from a point to the surface in a box and in all half-spaces; infinite if there
/// is no such surface. Everything is in local coordinates of the cell.
///
/// The surface is in a convex set: the intersection of the box, its slab and the half-spaces. For every unit vector u,
/// the distance from that set is at least the minimum of <u, x - point> over it. Three directions are tried for u: to
/// the middle of the slab within the half-spaces, perpendicular to the slab, and to the nearest point of the box. With
/// a multiplier for each half-space, the minimum is again one over the slab alone. Any multipliers that are not
/// negative give a valid bound; those are chosen that make u as parallel to the slab's normal as possible.
///
/// If the set's extent along the surface is h, its thickness is about h^2 and the error of the first u is h over the
/// distance. So the error of the bound is a multiple of h^2, and few boxes of each size remain, even if the surface is
/// parallel to the sphere around the point.
template <int Degree>
inline double distance_bound(const SurfaceBox<Degree>& box, const LatticeMetric& metric, const glm::dvec3& point_local,
                             std::span<const HalfSpace> half_spaces = {})
{
    constexpr std::size_t capacity = 8; // further half-spaces are left out; the bound remains valid
    constexpr int rounds = 8;
    const UnitSlab slab = slab_of<Degree>(box);
    const glm::dvec3 across = (slab.normal / box.size) * metric.to_lattice; // gradient of <normal, t> in the world
    const double square = glm::dot(across, across);
    std::array<CutInWorld, capacity> cuts;
    std::size_t cut_count = 0;
    for (const HalfSpace& half_space : half_spaces) {
        const glm::dvec3 farthest_out(glm::lessThan(half_space.normal, glm::dvec3(0.0)));
        const bool crosses = glm::dot(half_space.normal, box.lower + farthest_out * box.size) < half_space.offset;
        if (!crosses || cut_count == capacity)
            continue;
        const glm::dvec3 normal = half_space.normal * metric.to_lattice;
        const double length = glm::length(normal);
        cuts[cut_count++] = {normal / length, (half_space.offset - glm::dot(half_space.normal, point_local)) / length};
    }

    double bound = 0.0;
    const auto try_vector = [&](const glm::dvec3& u, double of_cuts) {
        const double least = least_over(slab, box.size * (u * metric.to_world)); // u^T L
        bound = std::max(bound, least + glm::dot(u, metric.to_world * (box.lower - point_local)) + of_cuts);
    };
    const auto try_direction = [&](const glm::dvec3& direction) {
        const double length = glm::length(direction);
        if (!(length > 0.0))
            return;
        const glm::dvec3 u = direction / length;
        try_vector(u, 0.0);
        if (cut_count == 0)
            return;
        std::array<double, capacity> multipliers{};
        glm::dvec3 rest = u, of_slab_alone = u;
        double of_cuts = 0.0;
        for (int round = 0; round < rounds; ++round) {
            if (square > 0.0)
                rest -= (glm::dot(rest, across) / square) * across;
            for (std::size_t i = 0; i < cut_count; ++i) {
                const double change = std::max(glm::dot(rest, cuts[i].normal), -multipliers[i]);
                multipliers[i] += change;
                rest -= change * cuts[i].normal;
            }
        }
        for (std::size_t i = 0; i < cut_count; ++i) {
            of_slab_alone -= multipliers[i] * cuts[i].normal;
            of_cuts += multipliers[i] * cuts[i].offset;
        }
        try_vector(of_slab_alone, of_cuts);
    };

    const glm::dvec3 nearest = glm::clamp(point_local, box.lower, box.lower + box.size);
    try_direction(metric.to_world * (nearest - point_local));
    if (square > 0.0) {
        const double to_middle = 0.5 * (slab.lower + slab.upper - slab.normal.x - slab.normal.y - slab.normal.z);
        glm::dvec3 middle =
            metric.to_world * (box.lower + 0.5 * box.size - point_local) + (to_middle / square) * across;
        const double height = glm::dot(across, middle);
        for (int round = 0; cut_count > 0 && round < rounds; ++round) {
            for (std::size_t i = 0; i < cut_count; ++i)
                middle += std::max(cuts[i].offset - glm::dot(cuts[i].normal, middle), 0.0) * cuts[i].normal;
            middle += ((height - glm::dot(across, middle)) / square) * across;
        }
        try_direction(middle);
        try_direction(height < 0.0 ? -across : across);
    }
    return bound;
}

} // namespace isospline
