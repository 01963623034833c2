// What a scene holds, shared by the sources that implement it.
#pragma once

#include "isospline/scene/device.h"
#include "isospline/scene/instance.h"
#include "isospline/scene/prepared_ray.h"
#include "isospline/scene/scene.h"

#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <unordered_map>
#include <vector>

namespace isospline {

struct ChordOfInstance;
struct RayQuery;

struct Scene::Impl {
    explicit Impl(BuildQuality quality);

    /// Adds an instance of what `given` holds.
    std::uint32_t add(PlacedObject given);
    void remove(std::uint32_t id);
    /// The instance of a geometry id; null where there is none.
    Instance* find(std::uint32_t id) const;
    /// The same; throws std::invalid_argument, which names the parameter, where there is none.
    Instance& instance(std::uint32_t id, const char* parameter) const;

    bool commit_is_due() const;
    /// Throws std::logic_error where a commit is due.
    void require_commit() const;
    void commit(const Progress& progress);
    void cast_singles(std::span<const Ray> rays, std::span<Hit> hits) const;
    template <int Size>
    void cast_packets(std::span<const Ray> rays, std::span<Hit> hits) const;

    /// All crossings of rays with what a top scene holds, for Scene::list_intersections().
    void list(RTCScene top, std::span<const Ray> rays, std::vector<Crossing>& crossings,
              std::span<std::uint32_t> counts) const;
    void list(RTCScene top, const Ray& ray, std::size_t index, RayQuery& query, std::vector<Crossing>& crossings) const;
    /// Adds those with the caps of an instance to its others, which are in order.
    void add_caps(const ChordOfInstance& of_instance, const Ray& ray, const PreparedRay& prepared,
                  std::vector<Crossing>& crossings) const;

    std::shared_mutex mutex;           ///< of all below: changes and commits own it, queries may share it
    mutable std::mutex instance_mutex; ///< of what users may ask for at any time: changes own this one too
    Device device;
    std::array<embree::SceneHandle, top_scene_count> tops;
    std::unordered_map<const void*, std::shared_ptr<Object>> objects; ///< by the isosurface or mesh that they show
    std::vector<std::unique_ptr<Instance>> instances;                 ///< by slot; null where that is free
    std::vector<std::uint32_t> free_slots;
    std::map<std::uint32_t, Instance*> instance_of_id;
    std::uint32_t next_id = 0;
    bool has_changed = false; ///< since the last commit; that objects have is theirs to tell
    std::uint64_t build_count = 0;
    RTCScene seen_by_shadows = nullptr; ///< one of the tops
    Box bounds;
    glm::dvec3 centre{0.0};
    Box centred_bounds; ///< a little larger than the bounds, relative to the centre; empty where these are
};

} // namespace isospline
