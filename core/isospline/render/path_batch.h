// The paths of some pixels, traced together: one batch of rays per bounce.
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

class Projection;
class SceneSnapshot;

/// The result of one path.
struct PathResult {
    glm::dvec3 radiance{0.0};
    glm::dvec3 direct{0.0}; ///< the part that was scattered at most once
    bool covered = false;   ///< whether the camera's ray met a surface, a light, or a visible environment
};

/// Traces one path from each of the rays, whose directions need not be of unit length; `random` has one sequence
/// each. The lights, materials and bounces are those of the path tracer, which must be valid. The projection gives the
/// depth of points.
void trace_paths(const SceneSnapshot& scene, const PathTracer& path_tracer, const Projection& projection,
                 std::span<const Ray> camera_rays, std::span<RandomSequence> random, std::span<PathResult> results);

} // namespace isospline
