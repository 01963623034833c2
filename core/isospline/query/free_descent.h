// Descent from a point to the locally nearest point of the surface, across cells.
#pragma once

#include "isospline/cell/jet.h"
#include "isospline/query/lattice_metric.h"
#include "isospline/query/surface_descent.h"
#include "isospline/trace/point_in_cell.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

namespace isospline {

/// A point of the surface whose gradient points to, or away from, the given point.
struct Foot {
    glm::ivec3 cell;
    glm::dvec3 local;
    glm::dvec3 gradient_world;
    double distance;
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
        if (!(glm::length(slope) > 0.0) || !(std::abs(value) <= descent_margin * glm::length(slope)))
            return std::nullopt;
        return Foot{end.index, end.local, slope * metric.to_lattice, metric.length(x - point)};
    }
    return std::nullopt;
}

} // namespace isospline
