// Half-spaces, and the parts of boxes and rays in them.
#pragma once

#include "isospline/math/box.h"
#include "isospline/math/ray.h"

#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <optional>
#include <vector>

namespace isospline {

/// The side of a plane that is kept: the points x with <normal, x> >= offset.
struct HalfSpace {
    glm::dvec3 normal{0.0, 0.0, 1.0};
    double offset = 0.0;

    bool operator==(const HalfSpace&) const = default;
};

/// The same half-space in another space, given the affine map from that other space to the half-space's own. Its normal
/// gets length one, so that <normal, x> - offset is a distance there.
HalfSpace pull_back(const HalfSpace& half_space, const glm::dmat4& map);

/// The half-spaces whose intersection is a box: one for each side that is not at infinity, lower and upper x, y, z.
/// Throws std::invalid_argument for an empty box.
std::vector<HalfSpace> half_spaces(const Box& box);

/// Planes closer than this to each other, in units of cells of lattice space, are taken for one: SolidPlanes moves them
/// onto each other. It is far above the rounding of distances in a grid of 65535 cells, 3e-11, and far below the
/// accuracy of hits, 1e-6.
inline constexpr double plane_margin = 1e-9;

/// The distances of the points of a box from a plane, positive in the half-space. The normal has length one.
struct DistanceRange {
    DistanceRange(const Box& box, const HalfSpace& half_space)
    {
        const double middle = glm::dot(half_space.normal, box.center()) - half_space.offset;
        const double reach = 0.5 * glm::dot(glm::abs(half_space.normal), box.size());
        least = middle - reach;
        most = middle + reach;
    }

    double least, most;
};

/// Whether a box of lattice space is outside of a half-space. A box that touches the plane is not.
inline bool is_outside(const Box& box, const HalfSpace& half_space)
{
    return DistanceRange(box, half_space).most < -plane_margin;
}

/// Whether a box of lattice space is inside of a half-space. A box that touches the plane is not: even after rounding,
/// all of its corners are farther away than the margin.
inline bool is_inside(const Box& box, const HalfSpace& half_space)
{
    return DistanceRange(box, half_space).least > 2.0 * plane_margin;
}

/// The part of a ray inside several half-spaces, and the half-spaces through whose planes it enters and leaves; -1 if
/// the ray itself begins or ends there.
struct Chord : Interval {
    int entry = -1, exit = -1;
};

/// The part of a ray inside all of the half-spaces, or nothing. The ray is in the half-spaces' space. Of equal
/// half-spaces, the first counts.
std::optional<Chord> clip(const Ray& ray, const std::vector<HalfSpace>& half_spaces);

} // namespace isospline
