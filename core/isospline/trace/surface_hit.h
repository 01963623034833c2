// From a root in a cell to a hit in world space.
#pragma once

#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/hit.h"

#include <glm/mat4x4.hpp>

namespace isospline {

/// Fills in a hit's normal and gradient magnitude from the gradient of f by lattice coordinates. `world_to_lattice`
/// leads from the space of the hit's normal to lattice space. Where the gradient vanishes the normal is zero.
void set_surface_normal(Hit& hit, const glm::dvec3& gradient_lattice, Inside inside,
                        const glm::dmat4& world_to_lattice);

/// Unit normals and lengths of gradients of a packet's hits.
struct NormalPacket {
    alignas(64) double normal[3][LatticeRayPacket::capacity];
    alignas(64) double magnitude[LatticeRayPacket::capacity];
};

/// The same for all lanes of a packet, bit for bit. Lanes that hold no root are harmless.
void surface_normals(const RootPacket& roots, Inside inside, const glm::dmat4& world_to_lattice, NormalPacket& normals);

} // namespace isospline
