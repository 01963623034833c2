// Rays through the bricks of a surface: from a box found by Embree down to the cells that may contain a crossing.
#pragma once

#include "isospline/brick/block.h"
#include "isospline/brick/bricks.h"
#include "isospline/cell/candidate_cells.h"
#include "isospline/cell/coefficients.h"
#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/math/box.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// The cells [lower, upper) of an octet of bricks that hold all its blocks in question, counted from its first cell.
struct ShellBox {
    std::array<std::uint8_t, 3> lower, upper;
    std::uint32_t octet; ///< place in Bricks::octets()
};

/// The boxes that contain all of a surface; octets without a block in question have none.
std::vector<ShellBox> shell_boxes(const Bricks& bricks);

/// The box in lattice space.
Box bounds_of(const Bricks& bricks, const ShellBox& box);

/// A block in one cache line. It belongs to a volume whose coefficients are in memory.
struct alignas(64) Leaf {
    glm::ivec3 first_cell() const { return {first[0], first[1], first[2]}; }

    Block block;
    std::array<std::uint16_t, 3> first; ///< its first cell
    const float* coefficients;          ///< of its first cell
};
static_assert(sizeof(Leaf) == 64);

/// All leaves of the bricks of one level.
class Leaves {
public:
    /// Two levels of two-scale subdivision (paper §5) remove cells. A cell stays unless its fine coefficients have one
    /// sign by more than rounding, so that the crossings of rays do not depend on it. The volume must outlive the
    /// object. Throws Cancelled if `progress` returns false.
    Leaves(const Volume& volume, const Bricks& bricks, const Progress& progress = {});

    std::size_t size() const { return leaves_.size(); }
    const Leaf& operator[](std::size_t index) const { return leaves_[index]; }
    int degree() const { return degree_; }
    double threshold() const { return threshold_; }
    std::ptrdiff_t row_stride() const { return row_stride_; }
    std::ptrdiff_t slice_stride() const { return slice_stride_; }
    std::size_t memory() const { return leaves_.capacity() * sizeof(Leaf); }

private:
    std::vector<Leaf> leaves_;
    int degree_;
    double threshold_;
    std::ptrdiff_t row_stride_, slice_stride_;
};

/// The box, in lattice space, of the parts of a leaf's cells that are in their slabs.
Box bounds_of(const Leaf& leaf);

/// Called for each cell of the shell in which a ray may cross the surface, roughly in the order in which the ray meets
/// them. Returns the t beyond which no crossing counts any more.
struct RayVisitor {
    double (*visit)(void* context, const CellCoefficients& cell, const glm::ivec3& index);
    void* context;
};

/// The cells in which the rays of a packet begin.
struct FirstCells {
    LaneMask lanes = 0; ///< that begin in a cell of the volume
    alignas(64) std::int32_t lower[3][packet_capacity];
};

/// Called for cells in which lanes of a packet may cross the surface. Lowers t_limit[lane] where it finds a crossing,
/// and returns whether it did. By default these are cells of one block.
struct PacketVisitor {
    bool (*visit)(void* context, const CandidateCells& cells);
    void* context;
    const double* t_limit;
    CandidateCells* waiting = nullptr;   ///< if given, cells of several blocks are collected here; some may be left
    const FirstCells* decided = nullptr; ///< if given, cells that are left out
};

/// Tests rays against the bricks of a box, the blocks of a brick and the cells of a block, side by side, and then
/// against the slabs of the cells. Cubes and slabs are widened by a margin that covers
/// the rounding of single precision, so that the result does not depend on it.
struct BrickTracer {
    void (*trace)(const Bricks& bricks, const ShellBox& box, const LatticeRay& ray, float margin, double t_limit,
                  const RayVisitor& visitor);
    void (*trace_packet)(const Bricks& bricks, const ShellBox& box, const LatticeRayPacket& rays, float margin,
                         LaneMask active, const PacketVisitor& visitor);
    /// The same for the cells of a leaf.
    void (*trace_leaf)(const Leaves& leaves, const Leaf& leaf, const LatticeRay& ray, float margin, double t_limit,
                       const RayVisitor& visitor);
    void (*trace_packet_in_leaf)(const Leaves& leaves, const Leaf& leaf, const LatticeRayPacket& rays, float margin,
                                 LaneMask active, const PacketVisitor& visitor);
    /// Finds the cells of a volume in memory in which rays begin, and adds them to `cells`, which has none yet.
    void (*add_first_cells)(const Volume& volume, const LatticeRayPacket& rays, LaneMask lanes, FirstCells& first,
                            CandidateCells& cells);
};

/// The tracer for the widest SIMD target of the machine.
BrickTracer brick_tracer();

} // namespace isospline
