// The convex hull of a few points, cut by planes.
#pragma once

#include "isospline/query/surface_box.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace isospline {

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

} // namespace isospline
