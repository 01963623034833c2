// What the instances of one isosurface or mesh share: an Embree scene of its own, in its local space.
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

#include <cstddef>
#include <span>

namespace isospline {

/// Where an instance of an object is.
struct Placement {
    glm::dmat4 transform{1.0};      ///< the object's world space to the scene's
    glm::dmat3 linear_inverse{1.0}; ///< back, but for the translation
    glm::dmat4 world_to_local{1.0};
    glm::dmat4 centred_to_local{1.0}; ///< from the scene's world space, moved to its centre
    double rounding_error = 0.0;      ///< in local space, of a ray that Embree traverses in single precision
};

/// The space of an object's own Embree geometry.
struct LocalSpace {
    glm::dmat4 to_object; ///< to the object's world space
    Box domain;           ///< holds what the object shows, at every level
};

/// Built once, by the thread that makes it; from then on any number of threads may use it, as it never changes.
class Object {
public:
    explicit Object(const LocalSpace& local) : local_(local) {}
    virtual ~Object() = default;
    Object(const Object&) = delete;
    Object& operator=(const Object&) = delete;

    const LocalSpace& local() const { return local_; }
    bool is_built() const { return scene_ != nullptr; }
    /// Whether what is built serves rays whose single precision rounding error in local space is this at most.
    virtual bool fits(double rounding_error_local) const = 0;
    /// The box of what the object shows, in local space. May have to be found, once.
    virtual Box bounds() const = 0;
    /// Builds the object's own Embree scene, its boxes wide enough for that rounding error.
    void build(const BuildOptions& options, double rounding_error_local, const Progress& progress);
    /// Bytes that the object holds for queries.
    std::size_t memory() const { return embree_memory_ + own_memory(); }
    /// Completes a hit, of which t, uv and primitive_id are given, for a ray in the scene's world space.
    /// `gradient_local` is that of the field at an isosurface's root, in local space.
    virtual void complete(Hit& hit, const Ray& ray_world, const glm::dvec3& gradient_local,
                          const Placement& placement) const = 0;
    /// The same, bit for bit, for hits of a packet: lane i is hits[i], whose t is t[i] as well.
    virtual void complete(std::span<Hit> hits, const RayPacket& rays_world, const double* t, LaneMask lanes,
                          const RootPacket& roots, const Placement& placement) const = 0;
    /// Whether the ray goes to the inner side at a complete hit; `rising` tells of an isosurface that f grows there.
    virtual bool is_entering(const Hit& hit, const Ray& ray_world, bool rising) const = 0;
    /// Puts crossings of one instance, in ascending order of t, in the order that the ray meets them in where t is
    /// rounded too much to tell.
    virtual void settle_order(std::span<Crossing>, const Ray&, const Placement&) const {}
    /// As Scene::offset_position(), in a scene of this frame.
    virtual glm::dvec3 offset_position(const Hit& hit, const glm::dvec3& towards, const RayFrame& frame,
                                       const Placement& placement) const = 0;

    /// The object's own Embree scene, which instances place in the top scene.
    RTCScene scene() const { return scene_.get(); }

private:
    /// The geometry of the object's own Embree scene.
    virtual embree::GeometryHandle make_geometry(const Device& device, const BuildOptions& options,
                                                 double rounding_error_local) = 0;
    /// Embree's not counted.
    virtual std::size_t own_memory() const { return 0; }

    LocalSpace local_;
    embree::SceneHandle scene_;
    std::size_t embree_memory_ = 0;
};

} // namespace isospline
