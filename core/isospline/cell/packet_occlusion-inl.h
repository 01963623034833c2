// Whether the rays of a packet cross the surface, each in its own cell; SIMD lanes are the rays. Included once for each
// target.
#include "isospline/cell/packet-inl.h"

#if defined(ISOSPLINE_CELL_PACKET_OCCLUSION_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_PACKET_OCCLUSION_INL_H
#undef ISOSPLINE_CELL_PACKET_OCCLUSION_INL_H
#else
#define ISOSPLINE_CELL_PACKET_OCCLUSION_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

// The lanes whose segments are within the rays' limits as a whole, so that the place of a root does not matter.
HWY_INLINE LaneMask lanes_within_limits(const LatticeRayPacket& rays, const PacketSegments& segments, LaneMask lanes)
{
    const Doubles d;
    LaneMask within = 0;
    for (std::size_t first = 0; first < LatticeRayPacket::capacity; first += hn::Lanes(d)) {
        if ((lanes >> first & all_lanes(d)) == 0)
            continue;
        const auto begins = are_within_limits(rays, first, hn::Load(d, segments.t_near + first));
        const auto ends = are_within_limits(rays, first, hn::Load(d, segments.t_far + first));
        within |= to_lane_mask(d, hn::And(begins, ends), first);
    }
    return within & lanes;
}

template <int Degree, class Cells>
LaneMask any_roots_in(const Cells& cells, const LatticeRayPacket& rays, LaneMask active)
{
    PacketSegments segments;
    const LaneMask inside = clip_packet(cells, rays, rays.t_far, active, segments);
    if (inside == 0)
        return 0;
    const PacketVerdict verdict = judge_packet<Degree>(cells, segments, inside);
    LaneMask found = lanes_within_limits(rays, segments, verdict.one_root);

    // Segments with one root that may be beyond a limit.
    RootPacket roots;
    const RefinedRoots refined =
        refine_packet<Degree>(cells, rays, segments, verdict, verdict.one_root & ~found, rays.t_far, roots);
    found |= refined.found;

    // The other segments, one by one.
    for (LaneMask rest = verdict.undecided | refined.undecided; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        if (exact_any_root<Degree>(cells.of_lane(lane), rays.ray(lane)))
            found |= LaneMask{1} << lane;
    }
    return found;
}

template <int Degree>
LaneMask exact_any_roots(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays)
{
    if (cells.are_copied)
        return any_roots_in<Degree>(CellsOfLanes<Degree>(cells, threshold), rays, cells.lanes);
    return any_roots_in<Degree>(OneCell<Degree>(cells, threshold), rays, cells.lanes);
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
