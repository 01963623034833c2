// Data that rays carry through Embree for meshes: the ray in the mesh's own space, and the nearest triangle so far.
#pragma once

#include "isospline/scene/embree_api.h"
#include "isospline/scene/object.h"
#include "isospline/trace/triangle.h"

#include <cstdint>

namespace isospline {

/// A ray in the space of an instance's mesh; the given ray if the instance is not moved.
inline TriangleRay ray_in_mesh(const Ray& ray_world, const Placement& placement)
{
    const glm::dvec3 translation(placement.transform[3]);
    return TriangleRay({placement.linear_inverse * (ray_world.origin - translation),
                        placement.linear_inverse * ray_world.direction, ray_world.t_near, ray_world.t_far});
}

/// A triangle that a ray crosses.
struct MeshHit {
    TriangleHit hit;
    std::uint32_t slot = RTC_INVALID_GEOMETRY_ID, primitive = 0;
};

} // namespace isospline
