// What a scene holds, shared by the sources that implement it.
#pragma once

#include "isospline/scene/device.h"
#include "isospline/scene/object.h"
#include "isospline/scene/scene.h"

#include <memory>
#include <mutex>
#include <vector>

namespace isospline {

struct RayQuery;

struct Scene::Impl {
    explicit Impl(BuildQuality quality);

    std::uint32_t add(std::unique_ptr<Object> object, PlacedObject given);
    /// Rounding error of a ray in an object's local space.
    double rounding_error(const Object& object) const;
    bool commit_is_due() const;
    /// Throws std::logic_error where a commit is due.
    void require_commit() const;
    void commit(const Progress& progress);
    void cast_singles(std::span<const Ray> rays, std::span<Hit> hits) const;
    template <int Size>
    void cast_packets(std::span<const Ray> rays, std::span<Hit> hits) const;

    /// All crossings of a ray, for Scene::list_intersections().
    void list(const Ray& ray, std::size_t index, RayQuery& query, std::vector<Crossing>& crossings) const;

    std::mutex commit_mutex;
    Device device;
    embree::SceneHandle top;
    std::vector<std::unique_ptr<Object>> objects;
    std::vector<PlacedObject> placed; ///< the same as they were given
    std::size_t committed_count = 0;
    Box bounds;
    glm::dvec3 centre{0.0};
    double radius = 0.0;
    Box centred_bounds; ///< a little larger than the bounds, relative to the centre; empty where these are
};

} // namespace isospline
