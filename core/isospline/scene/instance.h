// An object at its place in a scene.
#pragma once

#include "isospline/scene/object.h"
#include "isospline/scene/scene.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace isospline {

/// The queries that see different objects, each with a top scene of its own.
enum TopScene : std::size_t {
    camera_top, ///< of cast_rays() and list_intersections()
    shadow_top, ///< of test_occlusions() and list_occluders()
    top_scene_count
};

struct Instance {
    /// The box of the object in the scene's world space.
    Box bounds() const;
    /// Its placement in a scene of this radius about its centre. Throws std::invalid_argument where single precision
    /// cannot hold rays there.
    Placement placed(const glm::dvec3& centre, double radius) const;
    /// Hands the placement and the object's Embree scene on to Embree.
    void update(Device& device, const glm::dvec3& centre);
    /// Makes this the geometry `slot` of a top scene, or no part of it.
    void attach(Device& device, TopScene which, RTCScene top, bool visible);
    void detach(TopScene which, RTCScene top);

    std::uint32_t id;   ///< the geometry id that hits tell
    std::uint32_t slot; ///< its number in Embree: unlike ids, used again
    std::shared_ptr<Object> object;
    PlacedObject given;
    Placement placement;

private:
    glm::dmat4 local_to_world() const;

    embree::GeometryHandle geometry_;
    std::array<bool, top_scene_count> attached_{};
};

} // namespace isospline
