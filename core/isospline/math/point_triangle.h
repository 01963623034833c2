// The point of a triangle that is nearest to a given one.
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <iterator>

namespace isospline {

/// The point of a triangle that is nearest to a given one: C. Ericson, Real-Time Collision Detection, 2005, section
/// 5.1.5. A triangle without area is treated as its edges.
inline glm::dvec3 closest_point_of_triangle(const glm::dvec3& point, const glm::dvec3& a, const glm::dvec3& b,
                                            const glm::dvec3& c)
{
    const auto on_edge = [&point](const glm::dvec3& from, const glm::dvec3& to) {
        const glm::dvec3 along = to - from;
        const double square = glm::dot(along, along);
        return square > 0.0 ? from + std::clamp(glm::dot(point - from, along) / square, 0.0, 1.0) * along : from;
    };
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double square = glm::dot(normal, normal);
    if (square > 0.0) {
        const glm::dvec3 foot = point - (glm::dot(point - a, normal) / square) * normal;
        const auto is_inside = [&](const glm::dvec3& from, const glm::dvec3& to) {
            return glm::dot(glm::cross(to - from, foot - from), normal) >= 0.0;
        };
        if (is_inside(a, b) && is_inside(b, c) && is_inside(c, a))
            return foot;
    }
    glm::dvec3 best = on_edge(a, b);
    for (const glm::dvec3& other : {on_edge(b, c), on_edge(c, a)})
        if (glm::dot(other - point, other - point) < glm::dot(best - point, best - point))
            best = other;
    return best;
}

/// The coordinates (u, v) of the point (1 - u - v) a + u b + v c: C. Ericson, Real-Time Collision Detection, 2005,
/// section 5.1.5. Collinear corners give a point of the longest side.
inline glm::dvec2 closest_on_triangle(const glm::dvec3& point, const glm::dvec3& a, const glm::dvec3& b,
                                      const glm::dvec3& c)
{
    // The nearest points of the sides, and the foot of the perpendicular if it is inside.
    const auto along = [&](const glm::dvec3& from, const glm::dvec3& to) {
        const glm::dvec3 side = to - from;
        const double square = glm::dot(side, side);
        return square > 0.0 ? std::clamp(glm::dot(point - from, side) / square, 0.0, 1.0) : 0.0;
    };
    const glm::dvec3 ab = b - a, ac = c - a, ap = point - a, normal = glm::cross(ab, ac);
    const double square = glm::dot(normal, normal);
    if (square > 0.0) {
        const double u = glm::dot(glm::cross(ap, ac), normal) / square;
        const double v = glm::dot(glm::cross(ab, ap), normal) / square;
        if (u >= 0.0 && v >= 0.0 && u + v <= 1.0)
            return {u, v};
    }
    const double on_ab = along(a, b), on_ac = along(a, c), on_bc = along(b, c);
    const glm::dvec2 candidates[] = {{on_ab, 0.0}, {0.0, on_ac}, {1.0 - on_bc, on_bc}};
    const auto distance = [&](const glm::dvec2& uv) { return glm::length(ap - uv.x * ab - uv.y * ac); };
    return *std::min_element(std::begin(candidates), std::end(candidates),
                             [&](const glm::dvec2& p, const glm::dvec2& q) { return distance(p) < distance(q); });
}

} // namespace isospline
