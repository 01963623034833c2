// The Embree scene, in local space, that all instances of one isosurface or mesh share.
#pragma once

#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/math/box.h"
#include "isospline/math/ray.h"
#include "isospline/scene/build_options.h"
#include "isospline/scene/device.h"
#include "isospline/trace/hit.h"
#include "isospline/trace/prepared_ray.h"

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace isospline {

class IsosurfaceObject;

/// The placement of an instance of an object.
struct Placement {
    glm::dmat4 transform{1.0};      ///< the object's world space to the scene's
    glm::dmat3 linear_inverse{1.0}; ///< the linear part of the inverse
    glm::dmat4 world_to_local{1.0};
    glm::dmat4 centred_to_local{1.0}; ///< from the scene's world space, moved to its centre
    double rounding_error = 0.0;      ///< in local space, of a ray in single precision
};

/// The space of an object's own Embree geometry.
struct LocalSpace {
    glm::dmat4 to_object; ///< to the object's world space
    Box domain;           ///< contains the visible object at every level
};

/// Built once, by the thread that makes it. After that it never changes, and any number of threads may use it.
class Object {
public:
    explicit Object(const LocalSpace& local) : local_(local) {}
    virtual ~Object() = default;
    Object(const Object&) = delete;
    Object& operator=(const Object&) = delete;

    const LocalSpace& local() const { return local_; }
    /// The number of cells in local space along each axis; 1 for a mesh.
    virtual glm::ivec3 cell_shape() const { return glm::ivec3(1); }
    bool is_built() const { return scene_ != nullptr; }
    /// Whether the built scene is valid for rays whose single precision rounding error in local space is at most this.
    virtual bool fits(double rounding_error_local) const = 0;
    /// What building settled() costs, in the units of SettlingGain; 0 if there is nothing better.
    virtual std::uint64_t settling_cost() const { return 0; }
    /// The same object with an index that takes longer to build and is faster to trace, not built yet; or null.
    virtual std::shared_ptr<Object> settled() const { return nullptr; }
    /// This object if it traces incoherent rays in a stream of their own, which is faster than one by one; or null.
    virtual const IsosurfaceObject* with_stream() const { return nullptr; }
    /// The box of the visible object, in local space. The first call may have to compute it.
    virtual Box bounds() const = 0;
    /// The extent of the visible object, to about the size of a cell: the largest <direction, x> over its points, in
    /// local space, for each direction; minus infinity if nothing is visible.
    virtual std::vector<double> reach(std::span<const glm::dvec3> directions, const Progress& progress) const = 0;
    /// Builds the object's own Embree scene. Its boxes are wide enough for the given rounding error.
    void build(const BuildOptions& options, double rounding_error_local, const Progress& progress);
    /// Bytes that the object holds for queries.
    std::size_t memory() const { return embree_memory_ + own_memory(); }
    /// Completes a hit, whose t, uv and primitive_id are given, for a ray in the scene's world space.
    /// `gradient_local` is the gradient of f at an isosurface's root, in local space.
    virtual void complete(Hit& hit, const Ray& ray_world, const glm::dvec3& gradient_local,
                          const Placement& placement) const = 0;
    /// The same, bit for bit, for hits of a packet: lane i is hits[i], whose t is also t[i].
    virtual void complete(std::span<Hit> hits, const RayPacket& rays_world, const double* t, LaneMask lanes,
                          const RootPacket& roots, const Placement& placement) const = 0;
    /// Whether the ray goes to the inner side at a complete hit. For an isosurface, `rising` is whether f grows there.
    virtual bool is_entering(const Hit& hit, const Ray& ray_world, bool rising) const = 0;
    /// Sorts crossings of one instance, which are in ascending order of t, into the order in which the ray meets them,
    /// where t is rounded too much to decide it.
    virtual void settle_order(std::span<Crossing>, const Ray&, const Placement&) const {}
    /// Like SceneSnapshot::offset_position(), in a scene of this frame.
    virtual glm::dvec3 offset_position(const Hit& hit, const glm::dvec3& towards, const RayFrame& frame,
                                       const Placement& placement) const = 0;

    /// The object's own Embree scene, which instances place in the top scene.
    RTCScene scene() const { return scene_.get(); }

private:
    /// The geometry of the object's own Embree scene.
    virtual embree::GeometryHandle make_geometry(const Device& device, const BuildOptions& options,
                                                 double rounding_error_local, const Progress& progress) = 0;
    /// Without Embree's memory.
    virtual std::size_t own_memory() const { return 0; }

    LocalSpace local_;
    embree::SceneHandle scene_;
    std::size_t embree_memory_ = 0;
};

} // namespace isospline
