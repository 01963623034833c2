// The members of a scene snapshot, shared by the sources that implement it.
#pragma once

#include "isospline/scene/device.h"
#include "isospline/scene/instance.h"
#include "isospline/scene/ray_coherence.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/trace/prepared_ray.h"
#include "isospline/util/lazy.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace isospline {

struct ChordOfInstance;
struct RawCrossing;
struct RayQuery;

/// A crossing that will be sorted among crossings of other instances.
struct ListedCrossing {
    Crossing crossing;
    bool sorts_as_cap;
};

/// Appends the list of one ray to those of others, and sets its length. Throws std::length_error for more than the
/// largest number of Open3D's lists, 2^31 - 1.
void append_list(const std::vector<ListedCrossing>& of_ray, std::vector<Crossing>& crossings, std::uint32_t& count);

/// An isosurface of a scene, and its own snapshot.
struct SurfaceAtLevel {
    std::shared_ptr<const Isosurface> surface;
    std::shared_ptr<const IsosurfaceSnapshot> shown;
};

/// What a kind of rays meets: the instances that SeenBy::camera or SeenBy::shadow tells.
struct Met {
    /// More objects are traced faster in Embree, which visits the nearest ones first.
    static constexpr std::size_t most_streams = 4;

    RayFrame frame;
    embree::SceneHandle top;            ///< of all of them
    std::vector<std::uint32_t> streams; ///< the slots of those that trace rays in a stream, if these are few
    embree::SceneHandle others;         ///< of all but these, or null if there are none, or no streams
};

/// What rays are traced through: an Embree scene of instances, or the own scene of the only object that the rays see,
/// with the rays in its local space.
struct Traversal {
    RTCScene scene;
    const Instance* alone; ///< the only instance, or null
    std::uint32_t slot;    ///< of that instance
    const Met& met;        ///< for rays in streams
};

struct SceneSnapshot::Impl {
    /// The instance with a geometry id, or null.
    const Instance* find(std::uint32_t id) const;
    /// The same; if there is none, throws std::invalid_argument that names the parameter.
    const Instance& instance(std::uint32_t id, const char* parameter) const;

    /// All crossings of a ray with the objects that it meets, as SeenBy::camera or SeenBy::shadow says.
    void list(bool SeenBy::*sees, const Ray& ray, std::size_t index, RayQuery& query,
              std::vector<ListedCrossing>& crossings) const;
    /// The list of crossings in the order in which the ray meets them, from those in no order.
    void list(const Ray& ray, const RayLimits& limits, std::vector<RawCrossing>& raw,
              const std::vector<ChordOfInstance>& chords, std::vector<ListedCrossing>& crossings) const;
    /// Adds crossings with the caps of an instance to its other crossings, which are sorted.
    void add_caps(const ChordOfInstance& of_instance, const Ray& ray, const RayLimits& limits,
                  std::vector<ListedCrossing>& crossings) const;

    std::vector<std::shared_ptr<const Instance>> instances; ///< by slot, in the order of their ids
    std::vector<SurfaceAtLevel> surfaces;                   ///< each once
    RayFrame frame; ///< of all objects at all levels, so that rays do not depend on levels
    Met by_camera;
    std::optional<Met> by_shadow; ///< if shadow rays do not meet the same instances
    std::uint64_t version = 0;    ///< of the scene's edits
    std::uint32_t next_id = 0;    ///< above all ids used so far
    std::uint64_t build_count = 0;
    std::vector<std::shared_ptr<const Object>> objects; ///< of the instances, each once
    bool reads_sources = false;                         ///< whether coefficients of a surface are not in memory
    std::size_t top_memory = 0;                         ///< of the instances and the top scenes
    std::uint64_t settling_cost = 0;                    ///< of settling all indexes; 0 if they are settled
    /// What settled indexes would have saved the rays so far, in the units of SettlingGain.
    mutable std::atomic<std::uint64_t> settling_gain = 0;
    mutable Lazy<RayCoherence> camera_coherence, shadow_coherence;

    /// The coherence of rays that meet objects as SeenBy::camera or SeenBy::shadow says.
    const RayCoherence& coherence(bool SeenBy::*sees) const;

    /// What such rays meet.
    const Met& met(bool SeenBy::*sees) const { return sees == &SeenBy::shadow && by_shadow ? *by_shadow : by_camera; }
    Traversal traversal(bool SeenBy::*sees) const;
};

} // namespace isospline
