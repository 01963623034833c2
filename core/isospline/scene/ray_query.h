// What one ray carries through Embree: itself in double precision, and the nearest root found so far.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/scene/embree_api.h"
#include "isospline/shell/cutout.h"
#include "isospline/trace/lattice_ray.h"

#include <glm/mat4x4.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace isospline {

/// Embree traverses boxes in single precision; cells are solved in double precision on the ray kept here. The context
/// that Embree hands to the callbacks is the base of this object.
struct RayQuery : embree::QueryContext {
    explicit RayQuery(const Ray& ray) : world_ray(ray), t_hit(ray.t_far) { embree::initialize(*this); }

    /// The ray in an instance's lattice space, limited to what its cutouts leave; nothing where they leave nothing. The
    /// ray stays in one instance for many cells, so the last one is remembered.
    std::optional<LatticeRay>& in_lattice(std::uint32_t instance, const glm::dmat4& world_to_lattice,
                                          const std::vector<HalfSpace>& clip_lattice);

    Ray world_ray; ///< relative to the scene's centre, of unit direction
    double t_hit;  ///< nearest root of an isosurface so far, or the ray's t_far
    std::uint32_t cached_instance = RTC_INVALID_GEOMETRY_ID;
    std::optional<LatticeRay> cached_ray;
};

} // namespace isospline
