// Rays prepared for many cells: relative to the centre of the scene, with unit direction, and starting where their line
// enters the scene's box. Rounding then depends on the size of the scene, but not on the distance of the eye or on the
// limits of the ray.
#pragma once

#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/math/box.h"
#include "isospline/math/ray.h"
#include "isospline/spline/volume.h"
#include "isospline/trace/ray_packet.h"

#include <glm/mat4x4.hpp>

#include <cstddef>

namespace isospline {

/// The space that rays are prepared for.
struct RayFrame {
    RayFrame() = default;
    /// For objects in this box in world space.
    explicit RayFrame(const Box& bounds) : RayFrame(bounds, bounds.empty() ? glm::dvec3(0.0) : bounds.center()) {}
    /// The same about a centre that need not be that of the box.
    RayFrame(const Box& bounds, const glm::dvec3& about);

    glm::dvec3 centre{0.0};
    Box box;             ///< a little larger than the bounds, relative to the centre; empty if these are
    double radius = 0.0; ///< of the bounds, from the centre
};

/// The map from the space of prepared rays to an object's space, given the map from there to world space.
glm::dmat4 centred_to_local(const glm::dmat4& local_to_world, const RayFrame& frame);

struct PreparedRay {
    Ray ray; ///< limited to the box and, with a margin for rounding, to the limits
    RayLimits limits;
};

/// The same for up to 16 rays, in the first lanes.
struct PreparedPacket {
    static constexpr int capacity = packet_capacity;

    PreparedRay operator[](int lane) const
    {
        return {{{origin[0][lane], origin[1][lane], origin[2][lane]},
                 {direction[0][lane], direction[1][lane], direction[2][lane]},
                 t_near[lane],
                 t_far[lane]},
                limits[lane]};
    }

    int count = 0;
    alignas(64) double origin[3][capacity] = {}; ///< lanes beyond the count are harmless
    alignas(64) double direction[3][capacity] = {};
    alignas(64) double t_near[capacity] = {};
    alignas(64) double t_far[capacity] = {};
    RayLimitsPacket limits;
};

/// Prepares a ray; false if it misses the box. Throws std::invalid_argument for a ray that is not finite or has no
/// direction; `index` names it in the error.
bool prepare(const Ray& ray, std::size_t index, const RayFrame& frame, PreparedRay& result);

/// Prepares the rays of a packet, with the results of prepare(), bit for bit. `index` is that of the first ray. Returns
/// the rays that do not miss the box.
LaneMask prepare_packet(const RayPacket& rays, std::size_t index, const RayFrame& frame, PreparedPacket& packet);

/// The ray in the lattice space of a volume of `shape` cells, given the map from the space of prepared rays.
LatticeRay to_lattice(const PreparedRay& ready, const glm::dmat4& centred_to_lattice, const glm::ivec3& shape);

/// The same for a packet, bit for bit.
void to_lattice(const PreparedPacket& packet, const glm::dmat4& centred_to_lattice, const glm::ivec3& shape,
                LatticeRayPacket& rays);

} // namespace isospline
