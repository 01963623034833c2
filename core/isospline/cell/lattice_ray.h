// Rays against the cells of the lattice.
//
// A ray is a line with limits. The planes of the lattice cut the line into segments, and each segment belongs to one
// cell. The t of a plane is the same number in the cells on both of its sides. So every crossing belongs to one cell,
// in whatever order cells are visited, and f has the same sign at the end of a segment and at the start of the next
// one.
#pragma once

#include "isospline/math/ray.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

/// A direction component of zero gets a huge, finite inverse, so that no infinity meets a zero in a slab test.
inline constexpr double huge_inverse = 1e150;
/// The same in single precision.
inline constexpr double huge_inverse_single = 1e30;

/// The limits of a ray that has been moved along itself and scaled. They are in units of the original ray, so that a
/// limit that equals a hit's t includes the hit.
struct RayLimits {
    double given_t(double t) const { return shift + t / length; }
    /// The inverse; rays do not begin before 0.
    double moved_t(double given) const { return std::max((given - shift) * length, 0.0); }
    bool contain(double t) const
    {
        const double given = given_t(t);
        return given >= t_near && given <= t_far;
    }

    double shift = 0.0;  ///< the original t where the moved ray has t = 0
    double length = 1.0; ///< of the original direction, in units of the moved ray's
    double t_near, t_far;
};

/// A ray in lattice space, prepared to be tested against many cells.
struct LatticeRay {
    LatticeRay() = default;
    /// `shape` is the number of cells along each axis.
    LatticeRay(const Ray& ray, const glm::ivec3& shape);

    /// The t at which the line meets a plane of the lattice, perpendicular to an axis.
    double t_of_plane(int axis, double plane) const { return (plane - plane_origin[axis]) * inverse_direction[axis]; }

    /// The segment of the line that belongs to the cell whose lower corner is given; none unless t_near < t_far. The
    /// ray's limits do not matter.
    Interval inside_cell(const glm::dvec3& lower) const
    {
        Interval inside{-huge_inverse, huge_inverse};
        for (int axis = 0; axis < 3; ++axis) {
            const double to_lower = t_of_plane(axis, lower[axis]);
            const double to_upper = t_of_plane(axis, lower[axis] + 1.0);
            inside.t_near = std::max(inside.t_near, std::min(to_lower, to_upper));
            inside.t_far = std::min(inside.t_far, std::max(to_lower, to_upper));
        }
        return inside;
    }

    /// The local coordinates of an end of a cell's segment: exactly 0 or 1 along the axes whose planes contain it, and
    /// clamped to the cell along the others.
    glm::dvec3 local_end(double t, const glm::dvec3& lower) const
    {
        glm::dvec3 local = glm::clamp(at(t) - lower, 0.0, 1.0);
        for (int axis = 0; axis < 3; ++axis) {
            if (t_of_plane(axis, lower[axis]) == t)
                local[axis] = 0.0;
            else if (t_of_plane(axis, lower[axis] + 1.0) == t)
                local[axis] = 1.0;
        }
        return local;
    }

    /// Whether a crossing at t counts.
    bool is_within_limits(double t) const { return t >= t_near && t <= t_far && limits.contain(t); }

    glm::dvec3 at(double t) const { return origin + t * direction; }

    glm::dvec3 origin, direction, inverse_direction;
    glm::dvec3 plane_origin; ///< the origin; the middle of its cell along axes that the line is perpendicular to
    glm::vec3 direction_single, inverse_direction_single;
    double t_near, t_far; ///< the part of the line that cuts leave; without cuts, at least the limits
    RayLimits limits;
};

} // namespace isospline
