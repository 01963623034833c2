// Rays, in double precision, in any space.
#pragma once

#include "isospline/math/box.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace isospline {

/// The points origin + t direction with t in [t_near, t_far]; t is in units of the direction's length.
struct Ray {
    glm::dvec3 origin{0.0};
    glm::dvec3 direction{0.0, 0.0, 1.0};
    double t_near = 0.0;
    double t_far = std::numeric_limits<double>::infinity();

    glm::dvec3 at(double t) const { return origin + t * direction; }
};

/// A range of the ray parameter.
struct Interval {
    double t_near;
    double t_far;
};

/// Components of a direction below this count as zero when a ray is clipped.
inline constexpr double smallest_with_inverse = 1e-300;

/// The part of a ray inside a box, or nothing. A direction component of zero is allowed: the slab then contains all of
/// the ray or none of it.
inline std::optional<Interval> clip(const Ray& ray, const Box& box)
{
    Interval inside{ray.t_near, ray.t_far};
    for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(ray.direction[axis]) < smallest_with_inverse) {
            if (ray.origin[axis] < box.lower[axis] || ray.origin[axis] > box.upper[axis])
                return std::nullopt;
            continue;
        }
        const double inverse = 1.0 / ray.direction[axis];
        const double t_lower = (box.lower[axis] - ray.origin[axis]) * inverse;
        const double t_upper = (box.upper[axis] - ray.origin[axis]) * inverse;
        inside.t_near = std::max(inside.t_near, std::min(t_lower, t_upper));
        inside.t_far = std::min(inside.t_far, std::max(t_lower, t_upper));
    }
    if (inside.t_near > inside.t_far)
        return std::nullopt;
    return inside;
}

} // namespace isospline
