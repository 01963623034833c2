// Rays to measure with: those of two views in tiles, and those of ambient occlusion from what the whole view sees.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/trace/hit.h"

#include <cstddef>
#include <span>
#include <vector>

namespace isospline::bench {

enum class Rays {
    whole,                ///< primary rays of the view of all of the object
    close,                ///< of the view from so near that every ray hits
    ambient,              ///< from the isosurface, where the whole view sees it
    ambient_of_triangles, ///< the same from the mesh
};

/// Rays at the subject, made when first asked for.
const std::vector<Ray>& rays_of(Rays kind);

/// First hits of the isosurface by single rays, one of each ray, made when first asked for.
const std::vector<Hit>& hits_of(Rays kind);

/// What a ray hit, whatever it was.
struct SurfaceHit {
    double t; ///< infinite on a miss
    glm::dvec3 normal;
};

/// `count` rays of the density cos / pi about the normal from where rays hit, in their order; they start `offset` in
/// front of the surface.
std::vector<Ray> ambient_rays(std::span<const Ray> rays, std::span<const SurfaceHit> hits, std::size_t count,
                              double offset);

} // namespace isospline::bench
