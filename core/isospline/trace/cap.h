// Caps: the parts of planes inside the solid. They close the surface where a clip cuts it, and at the volume's border.
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

/// Boxes, in lattice space, that contain all caps of a surface.
struct CapBoxes {
    /// For each plane with caps, the boxes of bricks whose coefficients allow for the solid and that have kept cells.
    /// Boxes of one brick follow one another.
    std::vector<Box> boxes;
    std::vector<bool> of_plane; ///< whether there is one, for each plane of SolidPlanes::all()
};

CapBoxes cap_boxes(const IsosurfaceSnapshot& surface);

/// The chord of a ray that the planes of a solid keep, in lattice space. Its ends are tested at exactly the points
/// where the intervals of roots in cells begin and end, so that no ray passes between a cap and the surface.
struct CappedChord : Chord {
    glm::dvec3 origin, direction;

    CappedChord() = default;
    /// The chord of a ray with limits. An end outside of them, or on a plane without caps, is not on a cap.
    CappedChord(const Chord& chord, const glm::dvec3& ray_origin, const glm::dvec3& ray_direction,
                const RayLimits& limits, const CapBoxes& caps)
        : Chord(chord), origin(ray_origin), direction(ray_direction)
    {
        const auto has_caps = [&](int plane) { return plane >= 0 && caps.of_plane[static_cast<std::size_t>(plane)]; };
        entry = has_caps(entry) && limits.contain(t_near) ? entry : -1;
        exit = has_caps(exit) && limits.contain(t_far) ? exit : -1;
    }

    /// Whether the ray meets a cap where it comes in, or goes out, unless double precision rules that out.
    bool enters_cap(const IsosurfaceSnapshot& surface) const;
    bool leaves_cap(const IsosurfaceSnapshot& surface) const;
    /// The same, given whether the first and the last of the ray's crossings with the surface on the chord, if any,
    /// enter the solid. They decide the cases left open by rounding, so that crossings alternately enter and leave.
    CappedEnds capped_ends(const IsosurfaceSnapshot& surface, std::optional<bool> first_enters,
                           std::optional<bool> last_enters) const;

    /// The same without the crossings, unless double precision cannot decide it.
    std::optional<CappedEnds> certain_ends(const IsosurfaceSnapshot& surface) const;

    glm::dvec3 at(double t) const { return origin + t * direction; }
};

/// The gradient of f, with respect to lattice coordinates, at a point of the domain in lattice space.
glm::dvec3 gradient_lattice(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice);

} // namespace isospline
