// f - level on the lattice whose nodes are the corners of cells, or of equal parts of them.
#pragma once

#include "isospline/cell/value-inl.h"
#include "isospline/math/brent.h"
#include "isospline/math/roots-inl.h"
#include "isospline/query/lattice_metric.h"
#include "isospline/trace/point_in_cell.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace isospline {

/// The key of the crossing on an edge or a diagonal of the lattice: its lower node, and the bits of the coordinates
/// that increase by one along it. Coordinates have 20 bits.
using CrossingKey = std::uint64_t;
inline constexpr int key_bits = 20;

constexpr CrossingKey crossing_key(const glm::ivec3& lower, int direction)
{
    const glm::vec<3, std::uint64_t> at(lower);
    return ((at.z << key_bits | at.y) << key_bits | at.x) << 3 | static_cast<std::uint64_t>(direction);
}

/// Positions are in lattice space; nodes are the points at multiples of 1 / subdivision. On faces between cells, f is
/// computed in the upper cell, so it is the same number for each position, bit for bit.
template <int Degree>
class LatticeField {
public:
    /// `subdivision` is a power of two.
    LatticeField(const IsosurfaceSnapshot& surface, int subdivision)
        : surface_(surface), subdivision_(subdivision), nodes_(surface.volume().cell_shape() * subdivision + 1)
    {
    }

    const IsosurfaceSnapshot& surface() const { return surface_; }
    int subdivision() const { return subdivision_; }
    /// Nodes along x, y, z.
    const glm::ivec3& nodes() const { return nodes_; }
    glm::dvec3 position(const glm::ivec3& node) const { return glm::dvec3(node) / static_cast<double>(subdivision_); }

    double value(const glm::dvec3& position) const
    {
        const PointInCell point(surface_, position);
        return scalar::value_in_cell<Degree>(point.cell, point.local);
    }
    glm::dvec3 gradient(const glm::dvec3& position) const
    {
        const PointInCell point(surface_, position);
        return scalar::gradient_in_cell<Degree>(point.cell, point.local);
    }
    /// Whether a value belongs to the solid.
    bool is_solid(double value) const { return (value >= 0.0) == (surface_.options().inside == Inside::above); }

    /// A root on the segment between two positions of one cell with different signs of f - level.
    glm::dvec3 crossing(const glm::dvec3& first, const glm::dvec3& second) const;
    /// The root on an edge or a diagonal of the lattice.
    glm::dvec3 crossing(const glm::ivec3& lower, int direction) const;
    /// The point of the surface that Newton's method finds along the gradients in a metric, if it is not farther away
    /// than `reach`, in lattice units.
    std::optional<glm::dvec3> project(const glm::dvec3& position, double reach, const LatticeMetric& metric) const;

private:
    const IsosurfaceSnapshot& surface_;
    int subdivision_;
    glm::ivec3 nodes_;
};

template <int Degree>
glm::dvec3 LatticeField<Degree>::crossing(const glm::dvec3& first, const glm::dvec3& second) const
{
    const PointInCell middle(surface_, 0.5 * (first + second));
    const glm::dvec3 from = first - middle.cell.lower, step = second - first;
    const auto f = [&](double s) { return scalar::value_in_cell<Degree>(middle.cell, from + s * step); };
    const FunctionPoint begin{0.0, f(0.0)}, end{1.0, f(1.0)};
    // In this cell, rounding may change the sign of an end close to the surface.
    if ((begin.value < 0.0) == (end.value < 0.0))
        return std::abs(begin.value) < std::abs(end.value) ? first : second;
    return first + brent_root(f, begin, end, 0x1p-52) * step;
}

template <int Degree>
glm::dvec3 LatticeField<Degree>::crossing(const glm::ivec3& lower, int direction) const
{
    const glm::dvec3 begin = position(lower);
    const glm::ivec3 along(direction & 1, direction >> 1 & 1, direction >> 2);
    if (along.x + along.y + along.z > 1)
        return crossing(begin, position(lower + along));

    // Along an edge, f is a polynomial of the spline's degree.
    const int axis = direction >> 1;
    const int first_across = (axis + 1) % 3, second_across = (axis + 2) % 3;
    const PointInCell point(surface_, begin);
    const auto first = scalar::cell_weights<Degree>(point.local[first_across]);
    const auto second = scalar::cell_weights<Degree>(point.local[second_across]);
    Bernstein<Degree> line;
    for (int i = 0; i <= Degree; ++i) {
        double sum = 0.0;
        for (int k = 0; k <= Degree; ++k)
            for (int j = 0; j <= Degree; ++j) {
                glm::ivec3 at(0);
                at[axis] = i;
                at[first_across] = j;
                at[second_across] = k;
                sum += first[static_cast<std::size_t>(j)] * second[static_cast<std::size_t>(k)] *
                       point.cell(at.x, at.y, at.z);
            }
        line[static_cast<std::size_t>(i)] = sum;
    }
    line = scalar::bernstein_of_bspline<Degree>(line);
    double part = point.local[axis];
    for (int halves = subdivision_; halves > 1; halves /= 2) {
        Bernstein<Degree> left, right;
        split_in_half<Degree>(line, left, right);
        part *= 2.0;
        line = part < 1.0 ? left : right;
        part -= part < 1.0 ? 0.0 : 1.0;
    }
    double root = std::abs(line[0]) < std::abs(line[Degree]) ? 0.0 : 1.0; // rounding may change the sign of an end
    scalar::for_each_root<Degree>(line, [&](double s, bool) {
        root = s;
        return false;
    });
    glm::dvec3 result = begin;
    result[axis] += root / subdivision_;
    return result;
}

template <int Degree>
std::optional<glm::dvec3> LatticeField<Degree>::project(const glm::dvec3& from, double reach,
                                                        const LatticeMetric& metric) const
{
    const glm::dvec3 shape(surface_.volume().cell_shape());
    glm::dvec3 at = from;
    for (int iteration = 0; iteration < 32; ++iteration) {
        const PointInCell point(surface_, at);
        const auto [value, slope] = scalar::value_and_gradient_in_cell<Degree>(point.cell, point.local);
        const glm::dvec3 gradient(slope[0], slope[1], slope[2]), gradient_world = gradient * metric.to_lattice;
        const double square = glm::dot(gradient_world, gradient_world);
        if (!(square > 0.0))
            return std::nullopt;
        glm::dvec3 step = (-value / square) * (metric.to_lattice * gradient_world);
        // At the border of the domain, continue along it.
        const auto leaves = [&](int axis) {
            return (at[axis] <= 0.0 && step[axis] < 0.0) || (at[axis] >= shape[axis] && step[axis] > 0.0);
        };
        glm::dvec3 along = gradient;
        for (int axis = 0; axis < 3; ++axis)
            along[axis] = leaves(axis) ? 0.0 : gradient[axis];
        if (along != gradient) {
            if (!(glm::dot(along, along) > 0.0))
                return std::nullopt;
            step = (-value / glm::dot(along, along)) * along;
        }
        at = glm::clamp(at + step, glm::dvec3(0.0), shape);
        if (!(glm::distance(at, from) <= reach))
            return std::nullopt;
        if (glm::dot(step, step) < 1e-24) {
            const bool is_on_surface = std::abs(this->value(at)) <= 1e-11 * glm::length(gradient);
            return is_on_surface ? std::optional(at) : std::nullopt;
        }
    }
    return std::nullopt;
}

} // namespace isospline
