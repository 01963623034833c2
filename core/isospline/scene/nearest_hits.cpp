#include "isospline/scene/nearest_hits.h"

#include <bit>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/scene/nearest_hits.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/cell/candidate_cells-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

// Keeps the roots of lanes that have no hit yet. The numbers are those of given_t() and last_equal_t().
void KeepRoots(const RootPacket& roots, LaneMask lanes, const RayLimitsPacket& limits, PacketHits& hits)
{
    const hn::CappedTag<double, packet_capacity> d;
    for (std::size_t first = 0; first < packet_capacity; first += hn::Lanes(d)) {
        if ((lanes >> first & all_lanes(d)) == 0)
            continue;
        const auto mask = to_mask(d, lanes, first);
        const auto t = hn::Load(d, roots.t + first);
        const auto shift = hn::Load(d, limits.shift + first), length = hn::Load(d, limits.length + first);
        const auto size = hn::Add(t, hn::Mul(hn::Abs(shift), length));
        set_lanes(d, t, mask, hits.nearest.t + first);
        for (int axis = 0; axis < 3; ++axis)
            set_lanes(d, hn::Load(d, roots.gradient[axis] + first), mask, hits.nearest.gradient[axis] + first);
        set_lanes(d, hn::Add(shift, hn::Div(t, length)), mask, hits.nearest_given + first);
        set_lanes(d, hn::Add(t, hn::Mul(hn::Set(d, rounding_of_equal_t), size)), mask, hits.t_limit + first);
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(KeepRoots);

LaneMask PacketHits::record(LaneMask lanes, const RootPacket& roots, std::uint32_t slot,
                            const std::uint64_t* primitives, const RayLimitsPacket& limits)
{
    LaneMask nearest_lanes = lanes & ~hit_lanes;
    const LaneMask others = lanes & hit_lanes;
    if (nearest_lanes != 0)
        HWY_DYNAMIC_DISPATCH(KeepRoots)(roots, nearest_lanes, limits, *this);
    for (LaneMask rest = nearest_lanes; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        nearest_ids[lane] = {slot, false, primitives[lane]};
    }
    hit_lanes |= nearest_lanes;
    for (LaneMask rest = others; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        if (record(lane, roots.root(lane), {slot, false, primitives[lane]}, limits[lane]))
            nearest_lanes |= LaneMask{1} << lane;
    }
    return nearest_lanes;
}

} // namespace isospline
#endif
