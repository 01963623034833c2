// Rays and triangles, by one exact rule: a ray through a closed mesh alternately enters and leaves it, and each
// crossing is in one triangle. Rays through vertices, along edges and in faces are not special cases.
//
// The sign of an edge function tells on which side a line passes an edge. Signs are computed in double precision if its
// error bound allows, and otherwise exactly. A sign of zero is replaced by that of the line moved by (e, e^2, e^3) for
// an infinitesimal e > 0: H. Edelsbrunner, E. P. Muecke, "Simulation of simplicity", ACM Transactions on Graphics 9(1),
// 1990. A line moved in this way meets no edge, only the interior of faces.
#pragma once

#include "isospline/math/ray.h"

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <compare>
#include <optional>

namespace isospline {

struct Triangle {
    glm::dvec3 a, b, c;
};

/// A ray scaled for triangles: the largest component of its direction is between 1 and 2, to avoid under- and overflow.
struct TriangleRay {
    TriangleRay() = default;
    explicit TriangleRay(const Ray& ray);

    /// Whether t, of the original ray, is within its limits, inclusively.
    bool has(double t) const { return t >= t_near && t <= t_far; }

    glm::dvec3 origin, direction;
    double scale;         ///< a power of two: t of the original ray is t of this one times `scale`
    double t_near, t_far; ///< of the original ray
};

/// Where a ray crosses a triangle.
struct TriangleHit {
    double t;       ///< of the original ray
    double t_error; ///< bound on the error of t
    glm::dvec2 uv;  ///< weights of the second and the third corner
    bool entering;  ///< against the normal
};

/// Which way a line goes through a triangle.
enum class Passage : int {
    against_normal =
        -1, ///< the line enters the solid that the triangle bounds; corners are counter-clockwise as seen from outside
    none = 0,
    along_normal = 1
};

/// How a line goes through a triangle, computed exactly, for cases that double precision cannot decide. A line never
/// goes through a triangle without area, nor through one whose plane contains it.
Passage exact_passage(const glm::dvec3& origin, const glm::dvec3& direction, const Triangle& triangle);

/// The error of det(direction, p, q) is less than this times the square of the largest component of p and q, if the
/// largest component of the direction is at most 2: six products, each with seven roundings.
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

/// Where a ray, of any length, crosses a triangle that its line goes through. The error of t is at most 2^-24 of the
/// triangle's extent.
TriangleHit triangle_hit(const TriangleRay& ray, const Triangle& triangle, Passage passage);

/// Where a ray touches a triangle's edges, if its line passes them within rounding, on whichever side: at a distance of
/// at most touch_tolerance times the sum of the largest components of its origin and of the corners. For queries that
/// count touches, beside passage(). A triangle that is seen edge-on along the line, within rounding, is not touched:
/// one whose plane contains the line, or one without area.
std::optional<TriangleHit> triangle_touch(const TriangleRay& ray, const Triangle& triangle);

/// More than the rounding errors of the distance of a line from an edge.
inline constexpr double touch_tolerance = 32.0 * 0x1p-53;

/// Which of two triangles on a line it meets first, computed exactly; triangles in one plane are equivalent.
std::weak_ordering exact_order(const TriangleRay& ray, const Triangle& first, const Triangle& second);

} // namespace isospline
