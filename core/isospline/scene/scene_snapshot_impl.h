// What a scene snapshot holds, shared by the sources that implement it.
#pragma once

#include "isospline/scene/device.h"
#include "isospline/scene/instance.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/trace/prepared_ray.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace isospline {

struct ChordOfInstance;
struct RayQuery;

/// A crossing that is to be sorted among those of other instances.
struct ListedCrossing {
    Crossing crossing;
    bool sorts_as_cap;
};

/// An isosurface of a scene, and what it was for the snapshot.
struct SurfaceAtLevel {
    std::shared_ptr<const Isosurface> surface;
    std::shared_ptr<const IsosurfaceSnapshot> shown;
};

/// A query sees one of two Embree scenes of all instances, which are the same where all see the same objects.
struct SceneSnapshot::Impl {
    /// The instance of a geometry id; null where there is none.
    const Instance* find(std::uint32_t id) const;
    /// The same; throws std::invalid_argument, which names the parameter, where there is none.
    const Instance& instance(std::uint32_t id, const char* parameter) const;

    /// All crossings of rays with what an Embree scene holds, for list_intersections().
    void list(RTCScene top, std::span<const Ray> rays, std::vector<Crossing>& crossings,
              std::span<std::uint32_t> counts) const;
    void list(RTCScene top, const Ray& ray, std::size_t index, RayQuery& query,
              std::vector<ListedCrossing>& crossings) const;
    /// Adds those with the caps of an instance to its others, which are in order.
    void add_caps(const ChordOfInstance& of_instance, const Ray& ray, const PreparedRay& prepared,
                  std::vector<ListedCrossing>& crossings) const;

    std::vector<std::shared_ptr<const Instance>> instances; ///< by slot, in the order of their ids
    std::vector<SurfaceAtLevel> surfaces;                   ///< each once
    embree::SceneHandle camera_top;                         ///< of cast_rays() and list_intersections()
    embree::SceneHandle own_shadow_top;                     ///< null where shadow rays see what the camera does
    RayFrame frame;            ///< of all objects, whatever their levels: rays do not depend on these
    std::uint64_t version = 0; ///< of the scene's edits
    std::uint32_t next_id = 0; ///< above all ids that there have been
    std::uint64_t build_count = 0;
    std::vector<std::shared_ptr<const Object>> objects; ///< of the instances, each once
    std::size_t top_memory = 0;                         ///< of the instances and what is above them

    /// Of test_occlusions() and list_occluders().
    RTCScene shadow_top() const { return own_shadow_top ? own_shadow_top.get() : camera_top.get(); }
};

} // namespace isospline
