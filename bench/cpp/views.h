// Rays for measurements: those of two views in tiles, and ambient occlusion rays from the points that the whole view
// sees.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/trace/hit.h"

#include <cstddef>
#include <span>
#include <vector>

namespace isospline::bench {

enum class Rays {
    whole,                ///< primary rays of the view of the whole object
    close,                ///< of the close view, in which every ray hits
    ambient,              ///< from the visible points of the isosurface in the whole view
    ambient_of_triangles, ///< the same from the mesh
};

/// Rays at the subject, made when they are first needed.
const std::vector<Ray>& rays_of(Rays kind);

/// First hits of single rays with the isosurface, one per ray, computed when they are first needed.
const std::vector<Hit>& hits_of(Rays kind);

/// The hit of a ray with any object.
struct SurfaceHit {
    double t; ///< infinite on a miss
    glm::dvec3 normal;
};

/// `count` rays from the hits of rays, in their order, with the density cos / pi about the normal. They start `offset`
/// in front of the surface.
std::vector<Ray> ambient_rays(std::span<const Ray> rays, std::span<const SurfaceHit> hits, std::size_t count,
                              double offset);

} // namespace isospline::bench
