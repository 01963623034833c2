// An object placed in a scene.
#pragma once

#include "isospline/scene/object.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/trace/prepared_ray.h"

#include <glm/mat4x4.hpp>

#include <cstdint>
#include <memory>
#include <type_traits>

namespace isospline {

/// The box of a placed object, in the scene's world space.
Box placed_bounds(const Object& object, const glm::dmat4& transform);
/// A box that contains the object's boxes at all levels.
Box placed_domain(const LocalSpace& local, const glm::dmat4& transform);

/// The placement of an object in a scene whose frame contains all objects. `ray_radius` is that of the frames of the
/// rays that see the object. Throws std::invalid_argument if single precision cannot represent rays there.
Placement placed(const LocalSpace& local, const glm::dmat4& transform, const RayFrame& frame, double ray_radius,
                 std::uint32_t id);

/// A part of one scene snapshot, or of several consecutive ones. It never changes.
struct Instance {
    /// Passes the placement and the object's Embree scene, which must be built, to Embree.
    Instance(std::uint32_t id, std::shared_ptr<const Object> object, SnapshotObject shown, const Placement& placement,
             const glm::dvec3& centre);

    /// Whether an instance of this object with this placement would be the same, except for the rays that see it.
    bool is_same(const Object& other_object, const Placement& other_placement) const;

    std::uint32_t id; ///< the geometry id in hits
    std::shared_ptr<const Object> object;
    SnapshotObject shown;
    Placement placement;
    std::shared_ptr<std::remove_pointer_t<RTCGeometry>> geometry;
};

} // namespace isospline
