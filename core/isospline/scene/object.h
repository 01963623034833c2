// What the scene holds: objects, each with an Embree scene of its own that the top scene instances.
#pragma once

#include "isospline/math/box.h"
#include "isospline/math/ray.h"
#include "isospline/scene/device.h"
#include "isospline/trace/hit.h"

#include <glm/mat4x4.hpp>

#include <cstddef>
#include <cstdint>

namespace isospline {

class Object {
public:
    explicit Object(const glm::dmat4& transform) : transform_(transform) {}
    virtual ~Object() = default;
    Object(const Object&) = delete;
    Object& operator=(const Object&) = delete;

    /// The space of the object's own Embree geometry to the scene's world space.
    virtual glm::dmat4 local_to_world() const = 0;
    /// The box of the object in its local space.
    virtual Box local_bounds() const = 0;
    /// Whether a commit has to build the object's own Embree scene, given the single precision rounding error that rays
    /// have in local space.
    virtual bool is_stale(double rounding_error_local) const = 0;
    /// Builds the object's own Embree scene, its boxes wide enough for that rounding error.
    virtual void build(Device& device, double rounding_error_local, const Progress& progress) = 0;
    /// Bytes that the object holds for queries, Embree's not counted.
    virtual std::size_t memory() const { return 0; }
    /// Completes a hit, of which t and primitive_id are given, for a ray in the scene's world space. `gradient_local`
    /// is that of the field at an isosurface's root, in local space.
    virtual void complete(Hit& hit, const Ray& ray_world, const glm::dvec3& gradient_local) const = 0;
    /// Whether the ray goes to the inner side at a complete hit; `rising` tells of an isosurface that f grows there.
    virtual bool is_entering(const Hit& hit, const Ray& ray_world, bool rising) const = 0;
    /// Whether crossings of this object that follow each other, both entering or both leaving, are one that two
    /// primitives have found.
    virtual bool is_same_crossing(const Crossing& a, const Crossing& b, const Ray& ray_world) const = 0;
    /// As Scene::offset_position(), in a scene with the given centre; the rounding error is that of build().
    virtual glm::dvec3 offset_position(const Hit& hit, const glm::dvec3& towards, const glm::dvec3& centre,
                                       double rounding_error_local) const = 0;

    /// The map from the scene's world space, moved to its centre, to local space, in double precision.
    const glm::dmat4& centred_to_local() const { return centred_to_local_; }

    /// Places the object in a scene with the given centre, as instance `id` of the top scene.
    void place(Device& device, RTCScene top, std::uint32_t id, const glm::dvec3& centre);

    const glm::dmat4& transform() const { return transform_; }
    const glm::dmat4& world_to_local() const { return world_to_local_; }

protected:
    /// Puts the geometry into a new Embree scene and builds that; the one before is kept where this fails.
    void build_scene(Device& device, RTCGeometry geometry, const Progress& progress);

    embree::SceneHandle scene_;

private:
    glm::dmat4 transform_;
    glm::dmat4 centred_to_local_{1.0}, world_to_local_{1.0};
    embree::GeometryHandle instance_;
};

} // namespace isospline
