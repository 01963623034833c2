// The point of a triangle that is nearest to a given one.
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>

namespace isospline {

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
