// Points and the objects of a scene: which is nearest, and whether a point is in one.
#pragma once

#include "isospline/query/closest_point.h"
#include "isospline/scene/scene_snapshot.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace isospline {

/// The point of a scene that is nearest to another. Errors are as of ClosestPoint, and 0 on meshes.
struct SceneClosestPoint : ClosestPoint {
    std::uint32_t geometry_id = 0xffffffff;
    glm::dvec2 uv{0.0}; ///< in the triangle of a mesh
};

/// Finds nearest points on what rays of the camera meet: on surfaces as ClosestPointFinder, on meshes by point queries
/// of Embree, whose candidates are compared in double precision. Of objects that are equally near, it is the one with
/// the smallest id. The snapshot must outlive it.
class SceneClosestPointFinder {
public:
    /// Throws as ClosestPointFinder.
    explicit SceneClosestPointFinder(const SceneSnapshot& scene, const ClosestPointOptions& options = {});
    ~SceneClosestPointFinder();

    /// Of a finite point in world space. One thread at a time.
    SceneClosestPoint operator()(const glm::dvec3& point_world);

private:
    struct Target;

    ClosestPointOptions options_;
    std::vector<Target> targets_;
    std::vector<std::pair<double, Target*>> order_; ///< targets, the nearest box first
};

/// For each point whether it is in the solid of an isosurface, as contains() tells, or inside of a mesh, whose
/// triangles a ray from there meets an odd number of times: 1 or 0. Meshes must be closed for that. Objects are those
/// that rays of the camera meet.
void find_occupancy(const SceneSnapshot& scene, std::span<const glm::dvec3> points_world,
                    std::span<std::uint8_t> occupied);

} // namespace isospline
