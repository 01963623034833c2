// Rays against the cells of the lattice.
//
// A ray is a line with limits. The planes of the lattice cut the line into segments, each of which belongs to one cell;
// the t of a plane is the same number in the cells on both of its sides. So every crossing belongs to one cell,
// whichever way the cells are visited, and f has one sign where a segment ends and the next begins.
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

/// The limits of a ray that has been moved along itself and scaled. They are in units of the ray as it was given, so
/// that a limit that equals a hit's t includes the hit.
struct RayLimits {
    double given_t(double t) const { return shift + t / length; }
    /// The other way round; rays do not begin before 0.
    double moved_t(double given) const { return std::max((given - shift) * length, 0.0); }
    bool contain(double t) const
    {
        const double given = given_t(t);
        return given >= t_near && given <= t_far;
    }

    double shift = 0.0;  ///< the given t where the moved ray has t = 0
    double length = 1.0; ///< of the given direction, in units of the moved one's
    double t_near, t_far;
};

/// For a coordinate that is the same all along a line: the middle of the cell that the line belongs to. A line that
/// runs in a plane of the lattice belongs to the cell above it, or at the upper border of the grid to the cell below.
inline double middle_of_cell(double coordinate, int cell_count)
{
    return std::floor(coordinate) - (coordinate == cell_count) + 0.5;
}

/// A ray in lattice space that is about to meet many cells.
struct LatticeRay {
    LatticeRay() = default;
    /// `shape` is the number of cells along each axis.
    LatticeRay(const Ray& ray, const glm::ivec3& shape)
    {
        set(ray.origin, ray.direction, shape);
        t_near = ray.t_near;
        t_far = ray.t_far;
        limits = {0.0, 1.0, t_near, t_far};
    }

    /// Sets the line.
    void set(const glm::dvec3& line_origin, const glm::dvec3& line_direction, const glm::ivec3& shape)
    {
        for (int axis = 0; axis < 3; ++axis) {
            const double component = line_direction[axis];
            const bool has_inverse = std::abs(component) > 1.0 / huge_inverse;
            const double inverse = has_inverse ? 1.0 / component : std::copysign(huge_inverse, component);
            origin[axis] = line_origin[axis];
            plane_origin[axis] = has_inverse ? line_origin[axis] : middle_of_cell(line_origin[axis], shape[axis]);
            direction[axis] = component;
            inverse_direction[axis] = inverse;
            direction_single[axis] = static_cast<float>(component);
            inverse_direction_single[axis] =
                static_cast<float>(std::clamp(inverse, -huge_inverse_single, huge_inverse_single));
        }
    }

    /// Where the line meets a plane of the lattice across an axis.
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

    /// The local coordinates of an end of a cell's segment: exactly 0 or 1 along the axes whose planes it lies on, and
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
    glm::dvec3 plane_origin; ///< the origin; along axes perpendicular to the line, the middle of its cell
    glm::vec3 direction_single, inverse_direction_single;
    double t_near, t_far; ///< what cuts leave of the line; where there are none, at least the limits
    RayLimits limits;
};

} // namespace isospline
