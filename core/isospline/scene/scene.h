// Isosurfaces and meshes in one Embree scene.
#pragma once

#include "isospline/math/box.h"
#include "isospline/math/ray.h"
#include "isospline/scene/build_quality.h"
#include "isospline/scene/mesh.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/hit.h"
#include "isospline/util/progress.h"

#include <glm/mat4x4.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <span>
#include <variant>
#include <vector>

namespace isospline {

/// Which rays meet an object.
struct SeenBy {
    bool camera = true; ///< those of cast_rays() and list_intersections()
    bool shadow = true; ///< those of test_occlusions() and list_occluders()
};

/// What a scene holds under a geometry id, where it is, and what sees it.
struct PlacedObject {
    std::variant<std::shared_ptr<const Isosurface>, std::shared_ptr<const Mesh>> object;
    glm::dmat4 transform{1.0}; ///< the object's world space to the scene's
    SeenBy seen_by{};
};

/// Isosurfaces and triangle meshes that rays can be cast at.
///
/// Changes (objects added, moved and removed, another level of an isosurface) take effect at the next commit(), which
/// builds an isosurface or mesh once, however many times it has been added, and again only where its shape has changed.
///
/// Rays may be cast from any number of threads between two commits, and any number of threads may change and commit at
/// a time: one does so, the others wait. Where some cast while others change, the former hold() the scene meanwhile.
class Scene {
public:
    explicit Scene(BuildQuality quality = BuildQuality::medium);
    ~Scene();
    Scene(Scene&&) noexcept;
    Scene& operator=(Scene&&) noexcept;

    /// Adds an object, placed by `transform` (object's world space to the scene's). Returns its geometry id: ids count
    /// up from 0 and are never used again. Throws std::invalid_argument for a transform that is singular or not affine.
    std::uint32_t add(std::shared_ptr<const Isosurface> surface, const glm::dmat4& transform = glm::dmat4(1.0),
                      SeenBy seen_by = {});
    std::uint32_t add(std::shared_ptr<const Mesh> mesh, const glm::dmat4& transform = glm::dmat4(1.0),
                      SeenBy seen_by = {});

    /// These throw std::invalid_argument for an id that is not in the scene, and for a transform as add() does.
    void remove(std::uint32_t geometry_id);
    void set_transform(std::uint32_t geometry_id, const glm::dmat4& transform);
    void set_visibility(std::uint32_t geometry_id, SeenBy seen_by);

    /// Builds what has changed since the last commit; cheap where nothing has. Throws Cancelled where the callback
    /// returns false; another commit then starts that object again.
    void commit(const Progress& progress = {});

    /// Commits, and keeps the scene as it is then: changes by other threads wait for the end of this lock. The thread
    /// that has it must not change the scene.
    [[nodiscard]] std::shared_lock<std::shared_mutex> hold(const Progress& progress = {});
    /// The same for a scene that has not changed since it was committed: throws std::logic_error where it has.
    [[nodiscard]] std::shared_lock<std::shared_mutex> hold_committed() const;

    /// First crossing of each ray within its [t_near, t_far], on the calling thread. `coherent` traces rays that follow
    /// each other in packets, which is faster where they begin and run close together, as those of a small tile of a
    /// picture do; the hits are the same. Throws std::invalid_argument for a ray whose origin or direction is not
    /// finite or whose direction is zero, and std::logic_error where a commit is due.
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

    /// The box, in world space, of all meshes and all cells of shells and caps, as of the last commit; empty where
    /// there are none.
    Box bounds() const;
    /// What is under a geometry id. Throws std::invalid_argument for one that is not in the scene.
    PlacedObject object(std::uint32_t geometry_id) const;
    bool contains(std::uint32_t geometry_id) const;
    /// The geometry ids, ascending.
    std::vector<std::uint32_t> ids() const;
    /// How many there are.
    std::size_t count() const;
    /// Acceleration structures of isosurfaces and meshes that commits have built so far.
    std::uint64_t build_count() const;
    /// Bytes of this scene's acceleration structures, Embree's and what is kept of cells beside them, as of the last
    /// commit. Objects that were added many times count once.
    std::size_t memory() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace isospline
