#include "isospline/brick/solid_planes.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

namespace {

/// A bound on the rounding error of the distances of points of the domain from a half-space that was given in world
/// space, where a user may have computed it from the volume's maps in some ten operations.
double rounding_of(const HalfSpace& half_space, const Volume& volume)
{
    const glm::dmat4& map = volume.lattice_to_world();
    const glm::dvec3 size = glm::abs(half_space.normal);
    const double largest = std::max({size.x, size.y, size.z});
    const glm::dvec3 normal = half_space.normal / largest, steepness = glm::abs(normal);
    const glm::dvec3 shape(volume.cell_shape());
    double terms = std::abs(half_space.offset / largest) + glm::dot(steepness, glm::abs(glm::dvec3(map[3])));
    for (int axis = 0; axis < 3; ++axis)
        terms += shape[axis] * glm::dot(steepness, glm::abs(glm::dvec3(map[axis])));
    return 64.0 * 0x1p-53 * terms / glm::length(normal * glm::dmat3(map));
}

/// Whether two planes are within a margin of each other everywhere in a box.
bool is_same_plane(const HalfSpace& a, const HalfSpace& b, const Box& box, double margin)
{
    const DistanceRange difference(box, {a.normal - b.normal, a.offset - b.offset});
    return difference.least >= -margin && difference.most <= margin;
}

HalfSpace opposite(const HalfSpace& half_space)
{
    return {-half_space.normal, -half_space.offset};
}

/// The face of cells that is most nearly a plane, as a half-space with the same direction.
HalfSpace nearest_face(const HalfSpace& half_space, const Box& domain)
{
    const glm::dvec3& normal = half_space.normal;
    const glm::dvec3 steepness = glm::abs(normal);
    const int axis = steepness.x >= steepness.y && steepness.x >= steepness.z ? 0 : steepness.y >= steepness.z ? 1 : 2;
    glm::dvec3 middle = domain.center();
    middle[axis] = 0.0;
    HalfSpace face{glm::dvec3(0.0), 0.0};
    face.normal[axis] = normal[axis] < 0.0 ? -1.0 : 1.0;
    face.offset = face.normal[axis] * std::round((half_space.offset - glm::dot(normal, middle)) / normal[axis]);
    return face;
}

} // namespace

SolidPlanes::SolidPlanes(const Volume& volume, const std::vector<HalfSpace>& clip, bool capped, bool closed)
{
    const Box domain = domain_lattice(volume);
    const std::vector<HalfSpace> border = half_spaces(domain);
    for (const HalfSpace& given : clip) {
        HalfSpace plane = pull_back(given, volume.lattice_to_world());
        const double margin = std::max(plane_margin, rounding_of(given, volume));
        const auto take = [&](const HalfSpace& other) {
            const bool is_same = is_same_plane(plane, other, domain, margin);
            if (is_same)
                plane = other;
            return is_same;
        };
        if (!take(nearest_face(plane, domain)))
            static_cast<void>(std::any_of(clip_.begin(), clip_.end(), [&](const HalfSpace& other) {
                return take(other) || take(opposite(other));
            }));
        clip_.push_back(plane);
    }
    all_ = clip_;
    if (closed)
        all_.insert(all_.end(), border.begin(), border.end());
    const auto has = [](const std::vector<HalfSpace>& planes, const HalfSpace& plane) {
        return std::find(planes.begin(), planes.end(), plane) != planes.end();
    };
    for (std::size_t i = 0; i < all_.size(); ++i) {
        const HalfSpace& plane = all_[i];
        const auto place = all_.begin() + static_cast<std::ptrdiff_t>(i);
        const bool is_first = std::find(all_.begin(), place, plane) == place;
        has_caps_.push_back(is_first && (capped || (closed && has(border, plane))));
        caps_have_area_.push_back(has_caps_.back() && !has(clip_, opposite(plane)) && !has(border, opposite(plane)));
    }
}

bool SolidPlanes::have_caps() const
{
    return std::find(has_caps_.begin(), has_caps_.end(), true) != has_caps_.end();
}

} // namespace isospline
