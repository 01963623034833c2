// All roots of a packet of rays, each in its own cell: whether there are any, how many, and which; SIMD lanes are the
// rays. Included once for each target.
#include "isospline/cell/intersector.h"
#include "isospline/cell/packet-inl.h"

#if defined(ISOSPLINE_CELL_PACKET_CROSSINGS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_PACKET_CROSSINGS_INL_H
#undef ISOSPLINE_CELL_PACKET_CROSSINGS_INL_H
#else
#define ISOSPLINE_CELL_PACKET_CROSSINGS_INL_H
#endif

#include <bit>
#include <cstdint>
#include <vector>

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

// The lanes whose segments have exactly one root, which is within the rays' limits. Sets those that need another way.
template <int Degree, class Cells>
HWY_INLINE LaneMask lanes_with_one_root(const Cells& cells, const LatticeRayPacket& rays, LaneMask active,
                                        LaneMask& undecided)
{
    undecided = 0;
    PacketSegments segments;
    const LaneMask inside = clip_packet(cells, rays, rays.t_far, active, segments);
    if (inside == 0)
        return 0;
    const PacketVerdict<Degree> verdict = judge_packet<Degree>(cells, segments, inside);
    const LaneMask found = lanes_within_limits(rays, segments, verdict.one_root);

    // Segments with one root that may be beyond a limit.
    RootPacket roots;
    const RefinedRoots refined =
        refine_packet<Degree>(cells, rays, segments, verdict.scaled, verdict.one_root & ~found, rays.t_far, roots);
    undecided = verdict.undecided | refined.undecided;
    return found | refined.found;
}

template <int Degree, class Cells>
LaneMask any_roots_in(const Cells& cells, const LatticeRayPacket& rays, LaneMask active)
{
    LaneMask undecided;
    LaneMask found = lanes_with_one_root<Degree>(cells, rays, active, undecided);
    for (LaneMask rest = undecided; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        if (exact_any_root<Degree>(cells.of_lane(lane), rays.ray(lane)))
            found |= LaneMask{1} << lane;
    }
    return found;
}

template <int Degree, class Cells>
LaneMask count_roots_in(const Cells& cells, const LatticeRayPacket& rays, LaneMask active,
                        std::uint8_t* HWY_RESTRICT counts)
{
    LaneMask undecided;
    LaneMask found = lanes_with_one_root<Degree>(cells, rays, active, undecided);
    for (LaneMask rest = found; rest != 0; rest &= rest - 1u)
        counts[std::countr_zero(rest)] = 1;
    std::vector<CrossingInCell> crossings;
    for (LaneMask rest = undecided; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        crossings.clear();
        exact_all_roots<Degree>(cells.of_lane(lane), rays.ray(lane), crossings);
        counts[lane] = static_cast<std::uint8_t>(crossings.size());
        found |= static_cast<LaneMask>(!crossings.empty()) << lane;
    }
    return found;
}

template <int Degree, class Cells>
void visit_roots_in(const Cells& cells, const LatticeRayPacket& rays, LaneMask active, const RootVisitor& visitor)
{
    PacketSegments segments;
    const LaneMask inside = clip_packet(cells, rays, rays.t_far, active, segments);
    if (inside == 0)
        return;
    const PacketVerdict<Degree> verdict = judge_packet<Degree>(cells, segments, inside);
    RootPacket roots;
    const RefinedRoots refined =
        refine_packet<Degree>(cells, rays, segments, verdict.scaled, verdict.one_root, rays.t_far, roots);
    for (LaneMask rest = refined.found; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const bool rising = (verdict.rising >> lane & 1u) != 0;
        visitor.visit(visitor.context, lane, {roots.root(lane), rising}, segments.t_near[lane]);
    }
    std::vector<CrossingInCell> crossings;
    for (LaneMask rest = verdict.undecided | refined.undecided; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        crossings.clear();
        exact_all_roots<Degree>(cells.of_lane(lane), rays.ray(lane), crossings);
        for (const CrossingInCell& crossing : crossings)
            visitor.visit(visitor.context, lane, crossing, segments.t_near[lane]);
    }
}

template <int Degree>
LaneMask exact_any_roots(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays)
{
    return with_cells<Degree>(cells, threshold, [&](const auto& of_lanes) HWY_ATTR {
        return any_roots_in<Degree>(of_lanes, rays, cells.lanes);
    });
}

template <int Degree>
LaneMask exact_count_roots(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays,
                           std::uint8_t* counts)
{
    return with_cells<Degree>(cells, threshold, [&](const auto& of_lanes) HWY_ATTR {
        return count_roots_in<Degree>(of_lanes, rays, cells.lanes, counts);
    });
}

template <int Degree>
void exact_visit_roots(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays,
                       const RootVisitor& visitor)
{
    with_cells<Degree>(cells, threshold, [&](const auto& of_lanes) HWY_ATTR {
        visit_roots_in<Degree>(of_lanes, rays, cells.lanes, visitor);
    });
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
