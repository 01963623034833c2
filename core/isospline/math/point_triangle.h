// The point of a triangle that is nearest to a given one.
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <iterator>

namespace isospline {

/// The point of the edges of a triangle that is nearest to a given one.
inline glm::dvec3 closest_point_of_edges(const glm::dvec3& point, const glm::dvec3& a, const glm::dvec3& b,
                                         const glm::dvec3& c)
{
    const auto on_edge = [&point](const glm::dvec3& from, const glm::dvec3& to) {
        const glm::dvec3 along = to - from;
        const double square = glm::dot(along, along);
        return square > 0.0 ? from + std::clamp(glm::dot(point - from, along) / square, 0.0, 1.0) * along : from;
    };
    glm::dvec3 best = on_edge(a, b);
    for (const glm::dvec3& other : {on_edge(b, c), on_edge(c, a)})
        if (glm::dot(other - point, other - point) < glm::dot(best - point, best - point))
            best = other;
    return best;
}

/// The point of a triangle that is nearest to a given one, by the corner, edge or inner region in which the given one
/// is: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5. A triangle that is almost a line is treated as
/// its edges.
inline glm::dvec3 closest_point_of_triangle(const glm::dvec3& point, const glm::dvec3& a, const glm::dvec3& b,
                                            const glm::dvec3& c)
{
    constexpr double least_sine_square = 1e-20;
    const glm::dvec3 ab = b - a, ac = c - a, normal = glm::cross(ab, ac);
    const double square = glm::dot(normal, normal);
    if (!(square > least_sine_square * glm::dot(ab, ab) * glm::dot(ac, ac)))
        return closest_point_of_edges(point, a, b, c);
    const glm::dvec3 from_a = point - a, from_b = point - b, from_c = point - c;
    const double ab_a = glm::dot(ab, from_a), ac_a = glm::dot(ac, from_a);
    if (ab_a <= 0.0 && ac_a <= 0.0)
        return a;
    const double ab_b = glm::dot(ab, from_b), ac_b = glm::dot(ac, from_b);
    if (ab_b >= 0.0 && ac_b <= ab_b)
        return b;
    const double ab_c = glm::dot(ab, from_c), ac_c = glm::dot(ac, from_c);
    if (ac_c >= 0.0 && ab_c <= ac_c)
        return c;
    // The signed areas of the triangles of the foot of the perpendicular and each edge, up to a common factor.
    const double at_c = glm::dot(normal, glm::cross(from_a, from_b));
    if (at_c <= 0.0 && ab_a >= 0.0 && ab_b <= 0.0)
        return a + ab_a / (ab_a - ab_b) * ab;
    const double at_b = glm::dot(normal, glm::cross(from_c, from_a));
    if (at_b <= 0.0 && ac_a >= 0.0 && ac_c <= 0.0)
        return a + ac_a / (ac_a - ac_c) * ac;
    const double at_a = glm::dot(normal, glm::cross(from_b, from_c));
    const double bc_b = ac_b - ab_b, cb_c = ab_c - ac_c;
    if (at_a <= 0.0 && bc_b >= 0.0 && cb_c >= 0.0)
        return b + bc_b / (bc_b + cb_c) * (c - b);
    return point - glm::dot(from_a, normal) / square * normal;
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
