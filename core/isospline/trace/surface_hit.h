// From a root in a cell to a hit in world space.
#pragma once

#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/hit.h"
#include "isospline/trace/ray_packet.h"

#include <glm/mat4x4.hpp>

namespace isospline {

/// Fills in a hit's normal and gradient magnitude from the gradient of f by lattice coordinates. `world_to_lattice`
/// maps the space of the hit's normal to lattice space. If the gradient vanishes, the normal is zero.
void set_surface_normal(Hit& hit, const glm::dvec3& gradient_lattice, Inside inside,
                        const glm::dmat4& world_to_lattice);

/// The hits of the rays of a packet, with unit normals and lengths of gradients.
struct SurfaceHitPacket {
    alignas(64) double position[3][LatticeRayPacket::capacity];
    alignas(64) double normal[3][LatticeRayPacket::capacity];
    alignas(64) double gradient_magnitude[LatticeRayPacket::capacity];
};

/// The same for the rays of a packet, bit for bit, with positions at `t` along the rays. Lanes without a root are
/// harmless.
void set_surface_hits(SurfaceHitPacket& hits, const RayPacket& rays, const double* t, const RootPacket& roots,
                      Inside inside, const glm::dmat4& world_to_lattice);

} // namespace isospline
