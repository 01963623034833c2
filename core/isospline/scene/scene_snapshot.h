// The state of a scene at one time.
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

class Absorption;
class RayCoherence;

/// Which rays meet an object.
struct SeenBy {
    bool camera = true; ///< rays of cast_rays() and list_intersections()
    bool shadow = true; ///< rays of test_occlusions() and attenuate_rays(), and those of a path after the first

    bool operator==(const SeenBy&) const = default;
};

/// A snapshot of an isosurface, or a mesh.
using ShownObject = std::variant<std::shared_ptr<const IsosurfaceSnapshot>, std::shared_ptr<const Mesh>>;

/// An object of a scene snapshot with its placement and the rays that see it.
struct SnapshotObject {
    ShownObject object;
    glm::dmat4 transform{1.0}; ///< the object's world space to the scene's
    SeenBy seen_by{};
};

/// The result of Scene::snapshot(): all objects, built for rays. It never changes, so any number of threads may cast
/// rays at it while the scene changes. It lives as long as a pointer to it.
class SceneSnapshot {
public:
    struct Impl;
    explicit SceneSnapshot(std::unique_ptr<const Impl> impl);
    ~SceneSnapshot();
    SceneSnapshot(const SceneSnapshot&) = delete;
    SceneSnapshot& operator=(const SceneSnapshot&) = delete;

    /// First crossing of each ray within its [t_near, t_far], on the calling thread. With `coherent`, consecutive rays
    /// may be traced in packets. This is faster for rays that are close together, as those of a small tile of a
    /// picture; the hits are the same. `sees` tells which objects they meet. Throws std::invalid_argument for a ray
    /// whose origin or direction is not finite or whose direction is zero, and if there is not one hit for each ray.
    void cast_rays(std::span<const Ray> rays, std::span<Hit> hits, bool coherent = false,
                   bool SeenBy::*sees = &SeenBy::camera) const;

    /// Whether each ray crosses anything within its [t_near, t_far]: 1 or 0. Stops at the first crossing found. With
    /// `coherent`, consecutive rays are traced in packets. This is faster for rays that are close together, as those
    /// from neighbouring points to one light; the result is the same. Throws like cast_rays().
    void test_occlusions(std::span<const Ray> rays, std::span<std::uint8_t> occluded, bool coherent = false) const;

    /// The part of the light that is left at the end of each ray, from 0 to 1: all surfaces that test_occlusions() sees
    /// absorb light where the ray crosses them within its [t_near, t_far]. Less than 1% counts as none. Consecutive
    /// rays are traced in packets. Throws like cast_rays().
    ///
    /// With `thresholds`, a ray whose threshold is above 0 transmits all or nothing: 1 if at least this part of the
    /// light is left. The mean over random thresholds is the part that is left, and rays end earlier (E. Enderton et
    /// al., "Stochastic transparency", I3D 2010).
    void attenuate_rays(std::span<const Ray> rays, const Absorption& absorption, std::span<double> transmitted,
                        std::span<const double> thresholds = {}) const;

    /// All crossings of each ray within its [t_near, t_far], in ascending order. Each is listed once, even on a face
    /// between cells or an edge between triangles. Appends them, and sets their number for each ray. `coherent` rays
    /// are traced in packets; the lists are the same. Throws like cast_rays().
    void list_intersections(std::span<const Ray> rays, std::vector<Crossing>& crossings,
                            std::span<std::uint32_t> counts, bool coherent = false) const;

    /// The origin for a ray that leaves a hit in the direction `towards`. It is off the surface, on the side that the
    /// ray goes to, by no more than rounding requires (docs/method.md). A ray from there does not meet the surface at
    /// the hit again, but only where the surface really turns back to the ray. Needs the hit's position, normal and
    /// ids. Throws std::invalid_argument for ids that the scene does not have.
    glm::dvec3 offset_position(const Hit& hit, const glm::dvec3& towards) const;

    /// How rays are traced fastest that see objects as SeenBy::camera or SeenBy::shadow says.
    const RayCoherence& coherence(bool SeenBy::*sees) const;
    /// The box of all meshes, cells of shells, and caps, in world space; empty if there are none.
    Box bounds() const;
    /// The extent of the objects that the camera sees, to about the size of a cell: the largest <direction, x> over
    /// their points, in world space, for each direction; minus infinity if it sees nothing.
    std::vector<double> reach(std::span<const glm::dvec3> directions, const Progress& progress = {}) const;
    /// The object with a geometry id. Throws std::invalid_argument for an id that is not in the snapshot.
    const SnapshotObject& object(std::uint32_t geometry_id) const;
    bool contains(std::uint32_t geometry_id) const;
    /// The geometry ids, ascending.
    std::vector<std::uint32_t> ids() const;
    /// Whether the coefficients of an isosurface are not in memory.
    bool reads_sources() const;
    /// The number of acceleration structures of isosurfaces and meshes that the scene had built up to this snapshot.
    std::uint64_t build_count() const;
    /// Bytes of Embree's acceleration structures and of the cells that are kept with them. Objects that were added
    /// several times count once.
    std::size_t memory() const;

private:
    friend class RayCaster;
    friend class Scene;
    friend class SceneClosestPointFinder;
    friend struct SnapshotBuilder;
    std::unique_ptr<const Impl> impl_;
};

} // namespace isospline
