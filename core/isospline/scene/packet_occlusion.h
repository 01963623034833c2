// The query whether the rays of a packet are occluded, how much light they lose, or what they cross.
#pragma once

#include "isospline/cell/candidate_cells.h"
#include "isospline/scene/absorption.h"
#include "isospline/scene/ray_query.h"
#include "isospline/trace/brick_trace.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace isospline {

class IsosurfaceObject;

/// Occlusion needs any crossing, in any order. The cells in which rays begin are solved first, all at once. Other cells
/// are collected, and solved together as soon as one ray has two.
///
/// Through translucent surfaces, it needs all crossings, each once, up to the largest depth; and for lists, all of
/// them. For lists of what is seen, it takes part in the search for first hits, and a ray ends behind the crossing
/// where the largest depth is reached.
struct PacketOcclusion : PacketQuery {
    explicit PacketOcclusion(Instances instances_by_slot) : PacketQuery(instances_by_slot) { is_occlusion = true; }

    void begin(const RayPacket& rays, LaneMask used_lanes)
    {
        PacketQuery::begin(rays, used_lanes);
        occluded = undecided = waiting_.lanes = 0;
        depths.begin(Absorption::darkness);
        capped_.clear();
        if (all != nullptr)
            all->clear();
    }

    /// Enters an isosurface, as PacketQuery does, and solves the cells in which rays begin.
    void enter(std::uint32_t slot, const IsosurfaceObject& entered);
    /// Tests rays against the cells of a box of the isosurface; some cells may wait.
    void test(unsigned int primitive, LaneMask lanes);
    /// Solves the waiting cells.
    void finish();
    /// Ends Embree's rays where nothing more is listed of them.
    void end_rays(LaneMask lanes, float* t_far) const;
    /// Nothing more is asked of occluded rays.
    void set_occluded(LaneMask lanes);

    /// Whether each crossing matters, and not just any.
    bool needs_each() const { return absorption != nullptr || all != nullptr; }
    /// A ray crosses a surface once: it is occluded, or loses light. The gradient is that of an isosurface, in local
    /// space.
    void cross(int lane, std::uint32_t slot, double t_given, std::uint64_t primitive,
               const glm::dvec3& gradient_local = glm::dvec3(0.0));
    /// The same for a triangle, which may also be listed.
    void cross(int lane, std::uint32_t slot, std::uint32_t primitive, const TriangleHit& hit);
    /// Leaves the light of a ray to the list of its crossings.
    void set_undecided(int lane)
    {
        undecided |= LaneMask{1} << lane;
        set_occluded(LaneMask{1} << lane);
    }
    /// Those of some lanes whose caps of an instance were not asked for before.
    LaneMask without_caps(std::uint32_t slot, LaneMask lanes);

    const Absorption* absorption = nullptr; ///< if given, crossings absorb light, and the largest depth is occlusion
    /// If given, gets all crossings, or with an absorption those up to the largest depth; none occludes a ray.
    RawCrossings* all = nullptr;
    LaneMask occluded = 0;
    LaneMask undecided = 0; ///< occluded lanes whose crossings have to be listed
    PacketDepths depths;

private:
    bool solve(const CandidateCells& cells);
    void absorb(int lane, Absorption::Depth added);
    void list(int lane, const RawCrossing& crossing);
    void list_chords();

    const IsosurfaceObject* object_ = nullptr; ///< that rays are in
    bool has_lowered_ = false;                 ///< whether list() has lowered a limit
    FirstCells first_;                         ///< solved
    CandidateCells waiting_;
    std::vector<std::pair<std::uint32_t, LaneMask>> capped_; ///< by slot, lanes whose caps are known
};

} // namespace isospline
