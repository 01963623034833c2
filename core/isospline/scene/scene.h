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
#include <span>
#include <variant>
#include <vector>

namespace isospline {

/// What a scene holds under a geometry id, and where it is.
struct PlacedObject {
    std::variant<std::shared_ptr<const Isosurface>, std::shared_ptr<const Mesh>> object;
    glm::dmat4 transform{1.0}; ///< the object's world space to the scene's
};

/// Isosurfaces and triangle meshes that rays can be cast at.
///
/// Changes (added objects, another level of an isosurface) take effect at the next commit(). Rays may be cast from any
/// number of threads between two commits, and any number of threads may commit at a time: one builds, the others wait.
class Scene {
public:
    explicit Scene(BuildQuality quality = BuildQuality::medium);
    ~Scene();
    Scene(Scene&&) noexcept;
    Scene& operator=(Scene&&) noexcept;

    /// Adds an object, placed by `transform` (object's world space to the scene's). Returns its geometry id, which
    /// counts up from 0. Throws std::invalid_argument for a transform that is singular or not affine.
    std::uint32_t add(std::shared_ptr<const Isosurface> surface, const glm::dmat4& transform = glm::dmat4(1.0));
    std::uint32_t add(std::shared_ptr<const Mesh> mesh, const glm::dmat4& transform = glm::dmat4(1.0));

    /// Builds what has changed since the last commit; cheap where nothing has. Throws Cancelled where the callback
    /// returns false; another commit then starts that object again.
    void commit(const Progress& progress = {});

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

    /// Where a ray that leaves a hit in the direction `towards` begins: off the surface, to the side that it goes to,
    /// just as far as rounding makes necessary (docs/method.md). Cast from there it does not meet the surface that it
    /// leaves, but where that surface really turns back to it. Needs the hit's position, normal and ids;
    /// throws std::invalid_argument for ids that are not the scene's.
    glm::dvec3 offset_position(const Hit& hit, const glm::dvec3& towards) const;

    /// The box, in world space, of all meshes and all cells of shells, as of the last commit; empty where there are
    /// none.
    Box bounds() const;
    /// The object of a geometry id, which must be one that add() has returned.
    const PlacedObject& object(std::uint32_t geometry_id) const;
    /// Objects added.
    std::size_t count() const;
    /// Bytes of this scene's acceleration structures, Embree's and what is kept of cells beside them, as of the last
    /// commit.
    std::size_t memory() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace isospline
