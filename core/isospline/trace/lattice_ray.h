// Rays against the cells of the lattice.
#pragma once

#include "isospline/math/ray.h"

#include <algorithm>
#include <cmath>

namespace isospline {

/// Cells are widened by this on every side when a ray is clipped against them, so that rounding at a shared face opens
/// no crack: the polynomial of a cell extends past its faces and agrees there with the neighbour's up to order n-1.
/// Double precision rounds coordinates of up to 65536 cells to 1.5e-11.
inline constexpr double cell_margin = 1e-9;

/// A direction component of zero gets a huge, finite inverse, so that no infinity meets a zero in a slab test.
inline constexpr double huge_inverse = 1e150;
/// The same in single precision.
inline constexpr double huge_inverse_single = 1e30;

/// A ray in lattice space that is about to meet many cells.
struct LatticeRay {
    LatticeRay() = default;
    explicit LatticeRay(const Ray& ray) { set(ray.origin, ray.direction, ray.t_near, ray.t_far); }

    void set(const glm::dvec3& ray_origin, const glm::dvec3& ray_direction, double near_limit, double far_limit)
    {
        for (int axis = 0; axis < 3; ++axis) {
            const double component = ray_direction[axis];
            const double inverse =
                std::abs(component) > 1.0 / huge_inverse ? 1.0 / component : std::copysign(huge_inverse, component);
            origin[axis] = ray_origin[axis];
            direction[axis] = component;
            inverse_direction[axis] = inverse;
            direction_single[axis] = static_cast<float>(component);
            inverse_direction_single[axis] =
                static_cast<float>(std::clamp(inverse, -huge_inverse_single, huge_inverse_single));
        }
        t_near = near_limit;
        t_far = far_limit;
    }

    /// Where the ray is inside the cell whose lower corner is given, within [t_near, t_far]; empty if t_near > t_far.
    Interval inside_cell(const glm::dvec3& lower) const
    {
        Interval inside{t_near, t_far};
        for (int axis = 0; axis < 3; ++axis) {
            const double to_lower = (lower[axis] - cell_margin - origin[axis]) * inverse_direction[axis];
            const double to_upper = (lower[axis] + 1.0 + cell_margin - origin[axis]) * inverse_direction[axis];
            inside.t_near = std::max(inside.t_near, std::min(to_lower, to_upper));
            inside.t_far = std::min(inside.t_far, std::max(to_lower, to_upper));
        }
        return inside;
    }

    glm::dvec3 at(double t) const { return origin + t * direction; }

    glm::dvec3 origin, direction, inverse_direction;
    glm::vec3 direction_single, inverse_direction_single;
    double t_near, t_far;
};

} // namespace isospline
