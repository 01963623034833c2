// Convex polygons in space: cut by half-spaces, and the nearest point of one.
#pragma once

#include "isospline/math/point_triangle.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace isospline {

/// Corners in order; fewer than three for an empty polygon.
using ConvexPolygon = std::vector<glm::dvec3>;

/// The part with <normal, x> >= offset: I. Sutherland, G. Hodgman, "Reentrant polygon clipping", CACM 17(1), 1974.
inline ConvexPolygon cut(const ConvexPolygon& polygon, const glm::dvec3& normal, double offset)
{
    ConvexPolygon left;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const glm::dvec3 &corner = polygon[i], &next = polygon[(i + 1) % polygon.size()];
        const double here = glm::dot(normal, corner) - offset, there = glm::dot(normal, next) - offset;
        if (here >= 0.0)
            left.push_back(corner);
        if ((here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0))
            left.push_back(corner + here / (here - there) * (next - corner));
    }
    return left;
}

/// A length from half the width of a polygon to its width: its area over the largest distance between its corners. 0
/// for an empty polygon.
inline double width_of(const ConvexPolygon& polygon)
{
    glm::dvec3 area(0.0);
    double longest = 0.0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        if (i >= 2)
            area += 0.5 * glm::cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
        for (std::size_t j = 0; j < i; ++j)
            longest = std::max(longest, glm::length(polygon[i] - polygon[j]));
    }
    return longest > 0.0 ? glm::length(area) / longest : 0.0;
}

/// The point of a polygon with at least three corners that is nearest to another one.
inline glm::dvec3 closest_point_of_polygon(const glm::dvec3& point, const ConvexPolygon& polygon)
{
    glm::dvec3 best(0.0);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 2; i < polygon.size(); ++i) {
        const glm::dvec3 found = closest_point_of_triangle(point, polygon[0], polygon[i - 1], polygon[i]);
        const glm::dvec3 difference = found - point;
        if (const double square = glm::dot(difference, difference); square < least) {
            least = square;
            best = found;
        }
    }
    return best;
}

} // namespace isospline
