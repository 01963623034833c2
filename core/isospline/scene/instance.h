// An object at its place in a scene.
#pragma once

#include "isospline/scene/object.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/trace/prepared_ray.h"

#include <glm/mat4x4.hpp>

#include <cstdint>
#include <memory>
#include <type_traits>

namespace isospline {

/// The box, in the scene's world space, of an object that is placed there.
Box placed_bounds(const Object& object, const glm::dmat4& transform);
/// One that holds that of every level.
Box placed_domain(const LocalSpace& local, const glm::dmat4& transform);

/// The placement of an object in a scene. Throws std::invalid_argument where single precision cannot hold rays there.
Placement placed(const LocalSpace& local, const glm::dmat4& transform, const RayFrame& frame, std::uint32_t id);

/// Part of one scene snapshot, or of several in a row: it never changes.
struct Instance {
    /// Hands the placement and the object's Embree scene, which must be built, on to Embree.
    Instance(std::uint32_t id, std::shared_ptr<const Object> object, SnapshotObject shown, const Placement& placement,
             const glm::dvec3& centre);

    /// Whether one of this object, so placed, would be the same but for what sees it.
    bool is_same(const Object& other_object, const Placement& other_placement) const;

    std::uint32_t id; ///< the geometry id that hits tell
    std::shared_ptr<const Object> object;
    SnapshotObject shown;
    Placement placement;
    std::shared_ptr<std::remove_pointer_t<RTCGeometry>> geometry;
};

} // namespace isospline
