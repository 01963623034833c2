// Rays and triangles, by one rule that is exact: a ray through a closed mesh enters and leaves it in turn, each
// crossing is in one triangle, and neither vertices nor edges nor faces that hold the ray are special cases.
//
// A line passes an edge on the side that the sign of an edge function tells. Signs are computed in double precision
// where that is sure of them, and exactly where it is not. Where one is zero, it is that of the line moved by (e, e^2,
// e^3) for a vanishing e > 0: H. Edelsbrunner, E. P. Muecke, "Simulation of simplicity", ACM Transactions on Graphics
// 9(1), 1990. A line that has moved so meets no edge, so it meets faces in their inside only.
#pragma once

#include "isospline/math/ray.h"

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <compare>

namespace isospline {

struct Triangle {
    glm::dvec3 a, b, c;
};

/// A ray as it meets triangles: its direction has a largest component of 1 to 2, so that nothing under- or overflows.
struct TriangleRay {
    TriangleRay() = default;
    explicit TriangleRay(const Ray& ray);

    /// Whether t, of the ray as given, is within its limits, which belong to it.
    bool has(double t) const { return t >= t_near && t <= t_far; }

    glm::dvec3 origin, direction;
    double scale;         ///< a power of two: t of the ray as given is that of this one times it
    double t_near, t_far; ///< of the ray as given
};

/// Where a ray crosses a triangle.
struct TriangleHit {
    double t;       ///< of the ray as given
    double t_error; ///< how far from that the exact one may be
    glm::dvec2 uv;  ///< weights of the second and the third corner
    bool entering;  ///< against the normal
};

/// Which way a line goes through a triangle.
enum class Passage : int {
    against_normal = -1, ///< it enters what the triangle bounds; corners are counter-clockwise as seen from outside
    none = 0,
    along_normal = 1
};

/// How a line goes through a triangle where double precision is not sure. Never through one without an area, nor
/// through one in whose plane it is.
Passage exact_passage(const glm::dvec3& origin, const glm::dvec3& direction, const Triangle& triangle);

/// det(direction, p, q) is off by less than this times the square of the largest component of p and q where the largest
/// of the direction is at most 2: six products, each with seven roundings.
inline constexpr double edge_function_error = 2.0 * 6.0 * 8.0 * 0x1p-53;

inline Passage passage(const glm::dvec3& origin, const glm::dvec3& direction, const Triangle& triangle)
{
    const glm::dvec3 a = triangle.a - origin, b = triangle.b - origin, c = triangle.c - origin;
    const double past_c = glm::dot(glm::cross(direction, a), b);
    const double past_a = glm::dot(glm::cross(direction, b), c);
    const double past_b = glm::dot(glm::cross(direction, c), a);
    const double least = std::min({past_a, past_b, past_c}), largest = std::max({past_a, past_b, past_c});
    const auto size = [](const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); };
    const double extent = std::max({size(a), size(b), size(c)});
    const double error = edge_function_error * extent * extent;
    if (least < -error && largest > error)
        return Passage::none;
    if (least > error)
        return Passage::along_normal;
    if (largest < -error)
        return Passage::against_normal;
    return exact_passage(origin, direction, triangle);
}

/// Where a ray, of any length, crosses a triangle that its line goes through; t is off by 2^-24 of the triangle's
/// extent at most.
TriangleHit triangle_hit(const TriangleRay& ray, const Triangle& triangle, Passage passage);

/// Which of two triangles that a line goes through it meets first, exactly; they are equivalent where they are in one
/// plane.
std::weak_ordering exact_order(const TriangleRay& ray, const Triangle& first, const Triangle& second);

} // namespace isospline
