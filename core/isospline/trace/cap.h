// Caps: the parts of a clip's planes that are in the solid, which close the surface where it is cut.
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

/// The chord that a clip leaves of a ray in lattice space. Its ends are tested at the very points where the roots in
/// cells begin and end, so that no ray passes between a cap and the surface.
struct CappedChord : Chord {
    glm::dvec3 origin, direction;

    /// Whether the ray meets a cap where it comes in, or goes out, as far as double precision cannot rule that out.
    bool enters_cap(const IsosurfaceSnapshot& surface) const;
    bool leaves_cap(const IsosurfaceSnapshot& surface) const;
    /// The same, given whether the first and the last of the ray's crossings with the surface on the chord, if there
    /// are any, enter the solid: they decide where rounding leaves it open, so that crossings enter and leave in turn.
    CappedEnds capped_ends(const IsosurfaceSnapshot& surface, std::optional<bool> first_enters,
                           std::optional<bool> last_enters) const;

    /// An end that is not within a ray's limits is not on a cap.
    void drop_ends_beyond(const RayLimits& limits)
    {
        entry = limits.contain(t_near) ? entry : -1;
        exit = limits.contain(t_far) ? exit : -1;
    }

    glm::dvec3 at(double t) const { return origin + t * direction; }
};

/// Gradient of f, by lattice coordinates, at a point of the domain in lattice space.
glm::dvec3 gradient_lattice(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice);

/// Boxes, in lattice space, that hold all caps of a surface: of each half-space's plane, those of bricks of cells whose
/// coefficients leave room for the solid. None where the surface is not capped.
std::vector<Box> cap_boxes(const IsosurfaceSnapshot& surface);

} // namespace isospline
