// The paths of some pixels, traced together: one batch of rays a bounce.
#pragma once

#include "isospline/math/random.h"
#include "isospline/math/ray.h"
#include "isospline/render/path_tracer.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace isospline {

class Scene;

/// What came along one path.
struct PathResult {
    glm::dvec3 radiance{0.0};
    bool covered = false; ///< whether the camera's ray met a surface, a light, or an environment that is visible
};

/// Traces one path from each of the rays, whose directions need not be of unit length; `random` has one sequence each.
/// The lights, material and depth are those of the path tracer, which must be valid, and the scene committed.
void trace_paths(const Scene& scene, const PathTracer& path_tracer, std::span<const Ray> camera_rays,
                 std::span<RandomSequence> random, std::span<PathResult> results);

} // namespace isospline
