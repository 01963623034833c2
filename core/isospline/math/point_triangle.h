// The distance of a point from a triangle.
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>

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

} // namespace isospline
