// Queries of points in a scene: the nearest object, and whether a point is in an object.
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

/// The point of a scene that is nearest to a given one. Errors are those of ClosestPoint, and 0 on meshes.
struct SceneClosestPoint : ClosestPoint {
    std::uint32_t geometry_id = 0xffffffff;
    glm::dvec2 uv{0.0}; ///< in the triangle of a mesh
};

/// Finds nearest points on the objects that camera rays see. On surfaces it uses ClosestPointFinder; on meshes it uses
/// point queries of Embree and compares their candidates in double precision. If objects are equally near, the smallest
/// id wins. The snapshot must outlive it.
class SceneClosestPointFinder {
public:
    /// Throws like ClosestPointFinder.
    explicit SceneClosestPointFinder(const SceneSnapshot& scene, const ClosestPointOptions& options = {});
    ~SceneClosestPointFinder();

    /// The nearest point for a finite point in world space. One thread at a time.
    SceneClosestPoint operator()(const glm::dvec3& point_world);

private:
    struct Target;

    ClosestPointOptions options_;
    std::vector<Target> targets_;
    std::vector<std::pair<double, Target*>> order_; ///< targets, the nearest box first
};

/// For each point, 1 if it is in the solid of an isosurface, by contains(), or inside of a mesh; otherwise 0. A point
/// is inside of a mesh if a ray from it meets the mesh's triangles an odd number of times, so meshes must be closed.
/// Only objects that camera rays see count.
void find_occupancy(const SceneSnapshot& scene, std::span<const glm::dvec3> points_world,
                    std::span<std::uint8_t> occupied);

} // namespace isospline
