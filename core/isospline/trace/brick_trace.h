// Rays through the bricks of a surface: from a box that Embree has found down to the cells that may hold a crossing.
#pragma once

#include "isospline/brick/bricks.h"
#include "isospline/cell/coefficients.h"
#include "isospline/cell/lattice_ray_packet.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace isospline {

/// A cube of cells that holds a part of the shell: an octet of bricks, or what is left of one after some halvings.
struct ShellBox {
    std::uint32_t octet;       ///< place in Bricks::octets()
    std::uint8_t halvings = 0; ///< 0 to 4: its edge is 16 >> halvings cells
    std::uint8_t brick = 0;    ///< child of the octet, where there is a halving
    std::uint8_t block = 0;    ///< block of the brick, the first one of a cube of 8, where there are two or more
    std::uint8_t cell = 0;     ///< cell of the block, where there are four
};

/// The blocks of a brick that fill a cube of 2 x 2 x 2 blocks, the first of which is block 0.
inline constexpr std::uint64_t cube_of_blocks = 0x0033'0033;

/// The cubes that hold all of a surface, of 16 >> halvings cells an edge. With 2 halvings or more, all bricks are made.
std::vector<ShellBox> shell_boxes(const Bricks& bricks, int halvings);

/// A cube's box in lattice space; of an octet, that of its bricks.
Box bounds_of(const Bricks& bricks, const ShellBox& box);

/// Called for each cell of the shell that a ray may cross the surface in, about in the order that the ray meets them.
/// Returns the t behind which nothing counts any more.
struct RayVisitor {
    double (*visit)(void* context, const CellCoefficients& cell, const glm::ivec3& index);
    void* context;
};

/// The same for the lanes of a packet that may do so. Sets t_limit[lane] where it finds less, and returns whether it
/// did.
struct PacketVisitor {
    bool (*visit)(void* context, const CellCoefficients& cell, const glm::ivec3& index, LaneMask lanes);
    void* context;
    const double* t_limit;
};

/// Rays against the cubes of cells inside a box: halved, four times at most, into eight that are tested side by side,
/// then the slabs of the cells. In single precision; cubes and slabs are widened by a margin that covers its rounding,
/// so that what is found does not depend on it.
struct BrickTracer {
    void (*trace)(const Bricks& bricks, const ShellBox& box, const LatticeRay& ray, float margin, double t_limit,
                  const RayVisitor& visitor);
    void (*trace_packet)(const Bricks& bricks, const ShellBox& box, const LatticeRayPacket& rays, float margin,
                         LaneMask active, const PacketVisitor& visitor);
};

/// The tracer of the widest SIMD target that the machine has.
BrickTracer brick_tracer();

} // namespace isospline
