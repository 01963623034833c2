// Caps: the parts of a clip's planes inside the solid. They close the surface where it is cut.
#pragma once

#include "isospline/cell/lattice_ray.h"
#include "isospline/math/box.h"
#include "isospline/shell/isosurface.h"

#include <glm/vec3.hpp>

#include <optional>
#include <vector>

namespace isospline {

/// Whether the ends of a chord are on caps.
struct CappedEnds {
    bool entry = false, exit = false;
};

/// The chord of a ray that a clip keeps, in lattice space. Its ends are tested at exactly the points where the
/// intervals of roots in cells begin and end, so that no ray passes between a cap and the surface.
struct CappedChord : Chord {
    glm::dvec3 origin, direction;

    /// Whether the ray meets a cap where it comes in, or goes out, unless double precision rules that out.
    bool enters_cap(const IsosurfaceSnapshot& surface) const;
    bool leaves_cap(const IsosurfaceSnapshot& surface) const;
    /// The same, given whether the first and the last of the ray's crossings with the surface on the chord, if any,
    /// enter the solid. They decide the cases left open by rounding, so that crossings alternately enter and leave.
    CappedEnds capped_ends(const IsosurfaceSnapshot& surface, std::optional<bool> first_enters,
                           std::optional<bool> last_enters) const;

    /// An end outside of a ray's limits is not on a cap.
    void drop_ends_beyond(const RayLimits& limits)
    {
        entry = limits.contain(t_near) ? entry : -1;
        exit = limits.contain(t_far) ? exit : -1;
    }

    glm::dvec3 at(double t) const { return origin + t * direction; }
};

/// The gradient of f, with respect to lattice coordinates, at a point of the domain in lattice space.
glm::dvec3 gradient_lattice(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice);

/// Boxes, in lattice space, that contain all caps of a surface: for each half-space's plane, the boxes of bricks whose
/// coefficients allow for the solid and that have kept cells. Boxes of one brick follow one another. None if the
/// surface is not capped.
std::vector<Box> cap_boxes(const IsosurfaceSnapshot& surface);

} // namespace isospline
