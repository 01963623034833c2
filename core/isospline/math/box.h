// Axis-aligned boxes.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <limits>

namespace isospline {

/// An axis-aligned box; the default one is empty.
struct Box {
    glm::dvec3 lower{std::numeric_limits<double>::infinity()};
    glm::dvec3 upper{-std::numeric_limits<double>::infinity()};

    bool empty() const { return !(lower.x <= upper.x && lower.y <= upper.y && lower.z <= upper.z); }
    glm::dvec3 center() const { return 0.5 * (lower + upper); }
    glm::dvec3 size() const { return upper - lower; }

    /// Whether the boxes have a common point.
    bool meets(const Box& box) const
    {
        return lower.x <= box.upper.x && lower.y <= box.upper.y && lower.z <= box.upper.z && box.lower.x <= upper.x &&
               box.lower.y <= upper.y && box.lower.z <= upper.z;
    }

    /// Whether all of another box is in this one.
    bool contains(const Box& box) const
    {
        return lower.x <= box.lower.x && lower.y <= box.lower.y && lower.z <= box.lower.z && box.upper.x <= upper.x &&
               box.upper.y <= upper.y && box.upper.z <= upper.z;
    }

    /// Whether the interiors of the boxes have a common point.
    bool overlaps(const Box& box) const
    {
        return lower.x < box.upper.x && lower.y < box.upper.y && lower.z < box.upper.z && box.lower.x < upper.x &&
               box.lower.y < upper.y && box.lower.z < upper.z;
    }

    /// Grows the box to hold a point.
    void extend(const glm::dvec3& point)
    {
        lower = glm::min(lower, point);
        upper = glm::max(upper, point);
    }

    /// Grows the box to hold another one.
    void extend(const Box& box)
    {
        lower = glm::min(lower, box.lower);
        upper = glm::max(upper, box.upper);
    }
};

} // namespace isospline
