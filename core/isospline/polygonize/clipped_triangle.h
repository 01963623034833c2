// What planes across the axes leave of a triangle.
#pragma once

#include "isospline/math/box.h"
#include "isospline/polygonize/mesh_part.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

namespace isospline {

/// A triangle, or the convex polygon that planes across the axes leave of it.
struct ClippedTriangle {
    static constexpr int most_planes = 9;
    /// Each plane adds at most one corner, if rounding does not make an edge in the plane cross it more than once.
    static constexpr std::size_t capacity = 3 + most_planes;

    std::array<glm::dvec3, capacity> corners;
    std::size_t count = 0;
    bool has_too_many = false; ///< corners; nothing can be said of it

    ClippedTriangle() = default;
    explicit ClippedTriangle(const Corners& triangle) : count(triangle.size())
    {
        std::copy(triangle.begin(), triangle.end(), corners.begin());
    }

    Box box() const
    {
        Box box;
        for (std::size_t i = 0; i < count; ++i)
            box.extend(corners[i]);
        return box;
    }

    /// The part with x[axis] below or above a limit, which belongs to both.
    ClippedTriangle cut(int axis, double limit, bool is_above) const
    {
        ClippedTriangle part;
        part.has_too_many = has_too_many;
        for (std::size_t i = 0; i < count; ++i) {
            const glm::dvec3 &from = corners[i], &to = corners[i + 1 < count ? i + 1 : 0];
            const double begin = is_above ? from[axis] - limit : limit - from[axis],
                         end = is_above ? to[axis] - limit : limit - to[axis];
            if (begin >= 0.0)
                part.add(from);
            if ((begin >= 0.0) != (end >= 0.0)) {
                glm::dvec3 corner = from + begin / (begin - end) * (to - from);
                corner[axis] = limit;
                part.add(corner);
            }
        }
        return part;
    }

private:
    void add(const glm::dvec3& corner)
    {
        if (count == capacity)
            has_too_many = true;
        else
            corners[count++] = corner;
    }
};

} // namespace isospline
