// A scene as it is at one time.
#pragma once

#include "isospline/math/box.h"
#include "isospline/math/ray.h"
#include "isospline/scene/mesh.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/hit.h"

#include <glm/mat4x4.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <variant>
#include <vector>

namespace isospline {

/// Which rays meet an object.
struct SeenBy {
    bool camera = true; ///< those of cast_rays() and list_intersections()
    bool shadow = true; ///< those of test_occlusions() and list_occluders()

    bool operator==(const SeenBy&) const = default;
};

/// An isosurface as it was at the time, or a mesh.
using ShownObject = std::variant<std::shared_ptr<const IsosurfaceSnapshot>, std::shared_ptr<const Mesh>>;

/// What a scene snapshot holds under a geometry id, where it is, and what sees it.
struct SnapshotObject {
    ShownObject object;
    glm::dmat4 transform{1.0}; ///< the object's world space to the scene's
    SeenBy seen_by{};
};

/// What Scene::snapshot() returns: everything that rays can meet, built for them. It never changes, so that any number
/// of threads may cast rays at it while the scene changes, and whoever holds it keeps it alive.
class SceneSnapshot {
public:
    struct Impl;
    explicit SceneSnapshot(std::unique_ptr<const Impl> impl);
    ~SceneSnapshot();
    SceneSnapshot(const SceneSnapshot&) = delete;
    SceneSnapshot& operator=(const SceneSnapshot&) = delete;

    /// First crossing of each ray within its [t_near, t_far], on the calling thread. `coherent` traces rays that follow
    /// each other in packets, which is faster where they begin and run close together, as those of a small tile of a
    /// picture do; the hits are the same. Throws std::invalid_argument for a ray whose origin or direction is not
    /// finite or whose direction is zero.
    void cast_rays(std::span<const Ray> rays, std::span<Hit> hits, bool coherent = false) const;

    /// Whether each ray crosses anything within its [t_near, t_far]: 1 or 0. Stops at the first crossing found. Throws
    /// as cast_rays() does.
    void test_occlusions(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const;

    /// All crossings of each ray within its [t_near, t_far], in ascending order, each once, also where it lies on a
    /// face between cells or an edge between triangles. Appends them, and sets how many each ray has. Throws as
    /// cast_rays() does.
    void list_intersections(std::span<const Ray> rays, std::vector<Crossing>& crossings,
                            std::span<std::uint32_t> counts) const;

    /// The same of what test_occlusions() sees.
    void list_occluders(std::span<const Ray> rays, std::vector<Crossing>& crossings,
                        std::span<std::uint32_t> counts) const;

    /// Where a ray that leaves a hit in the direction `towards` begins: off the surface, to the side that it goes to,
    /// just as far as rounding makes necessary (docs/method.md). Cast from there it does not meet the surface that it
    /// leaves, but where that surface really turns back to it. Needs the hit's position, normal and ids;
    /// throws std::invalid_argument for ids that are not the scene's.
    glm::dvec3 offset_position(const Hit& hit, const glm::dvec3& towards) const;

    /// The box, in world space, of all meshes and all cells of shells and caps; empty where there are none.
    Box bounds() const;
    /// What is under a geometry id. Throws std::invalid_argument for one that is not in the snapshot.
    const SnapshotObject& object(std::uint32_t geometry_id) const;
    bool contains(std::uint32_t geometry_id) const;
    /// The geometry ids, ascending.
    std::vector<std::uint32_t> ids() const;
    /// Acceleration structures of isosurfaces and meshes that the scene had built by then.
    std::uint64_t build_count() const;
    /// Bytes of acceleration structures, Embree's and what is kept of cells beside them. Objects that were added many
    /// times count once.
    std::size_t memory() const;

private:
    friend class RayCaster;
    friend class Scene;
    friend class SceneClosestPointFinder;
    friend struct SnapshotBuilder;
    std::unique_ptr<const Impl> impl_;
};

} // namespace isospline
