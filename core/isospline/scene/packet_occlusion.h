// The query whether the rays of a packet are occluded.
#pragma once

#include "isospline/cell/candidate_cells.h"
#include "isospline/scene/ray_query.h"
#include "isospline/trace/brick_trace.h"

#include <cstdint>

namespace isospline {

class IsosurfaceObject;

/// Occlusion needs any crossing, in any order. The cells in which rays begin are solved first, all at once. Other cells
/// are collected, and solved together as soon as one ray has two.
struct PacketOcclusion : PacketQuery {
    using PacketQuery::PacketQuery;

    void begin(const RayPacket& rays, LaneMask used_lanes)
    {
        PacketQuery::begin(rays, used_lanes);
        occluded = waiting_.lanes = 0;
    }

    /// Enters an isosurface, as PacketQuery does, and solves the cells in which rays begin.
    void enter(std::uint32_t slot, const IsosurfaceObject& entered);
    /// Tests rays against the cells of a box of the isosurface; some cells may wait.
    void test(unsigned int primitive, LaneMask lanes);
    /// Solves the waiting cells.
    void finish();
    /// Nothing more is asked of occluded rays.
    void set_occluded(LaneMask lanes);

    LaneMask occluded = 0;

private:
    bool solve(const CandidateCells& cells);

    const IsosurfaceObject* object_ = nullptr; ///< that rays are in
    FirstCells first_;                         ///< solved
    CandidateCells waiting_;
};

} // namespace isospline
