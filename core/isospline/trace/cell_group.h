// Blocks of 2 x 2 x 2 cells: what a ray meets first, before any cell.
#pragma once

#include "isospline/math/box.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/cell_block.h"
#include "isospline/trace/lattice_ray_packet.h"

#include <glm/vec3.hpp>

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace isospline {

/// The cells of the shell in one block, which follow each other in Shell::cells(). Cell i of the block is at
/// (i & 1, i >> 1 & 1, i >> 2) from its corner.
struct CellGroup {
    static constexpr int capacity = 8;

    /// Cell i of the block, member or not.
    Cell cell(int i) const
    {
        const auto at = [&](std::size_t axis) {
            return static_cast<std::uint16_t>(corner[axis] + (static_cast<unsigned>(i) >> axis & 1u));
        };
        return {at(0), at(1), at(2)};
    }

    /// Row of Shell::cells() of a cell that is a member.
    std::uint32_t row(int cell) const
    {
        return first_row + static_cast<std::uint32_t>(std::popcount(members & ((1u << cell) - 1u)));
    }

    std::array<std::uint16_t, 3> corner; ///< even cell indices
    /// In each cell, the surface is where lower <= <normal, local> <= upper, local being coordinates in [0, 1]^3, in an
    /// oriented slab; components of normals are at most 31.
    std::array<std::int8_t, capacity> slab_normal[3];
    std::array<std::int8_t, capacity> slab_lower, slab_upper;
    std::uint32_t first_row;
    std::uint8_t members; ///< bit i: cell i is in the shell
};

/// The groups of a surface's shell, in its order.
std::vector<CellGroup> cell_groups(const IsosurfaceSnapshot& surface);

/// Sets the slabs of the members of a group. `corner` is the group's first cell, member or not.
void set_slabs(CellGroup& group, const CellBlock& corner, int degree);

/// The box, in lattice space, of what a group's cells have in common with their slabs, up to the rounding of single
/// precision in [0, 2]; empty where that is nothing.
Box bounds(const CellGroup& group);

/// Where a ray enters the cells of a group that it meets.
struct GroupEntries {
    alignas(32) float t_near[CellGroup::capacity];
    unsigned cells; ///< bit i: the ray meets cell i
};

/// Rays against cells and their slabs in single precision, all of a group's cells, or all rays of a
/// packet, at a time. Boxes and slabs are widened by a margin that covers the rounding.
struct GroupCuller {
    /// The cells of which a ray meets a part that is in the slab, before t_far.
    GroupEntries (*entries)(const CellGroup& group, const LatticeRay& ray, float margin);
    /// For each cell, the rays of a packet that do so, before t_limit as well, of which there is one a lane.
    std::array<LaneMask, CellGroup::capacity> (*lanes)(const CellGroup& group, const LatticeRayPacket& rays,
                                                       const double* t_limit, LaneMask active, float margin);
};

/// The culler of the widest SIMD target that the machine has.
GroupCuller group_culler();

} // namespace isospline
