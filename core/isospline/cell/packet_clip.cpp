#include "isospline/cell/packet_clip.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/cell/packet_clip.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/cell/lane_mask-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

LaneMask ClipPacket(LatticeRayPacket& rays, LaneMask lanes, const std::vector<HalfSpace>& half_spaces,
                    PlanesOfChords& through)
{
    const hn::CappedTag<double, packet_capacity> d;
    using V = hn::Vec<decltype(d)>;
    const V zero = hn::Zero(d);
    LaneMask left = 0;
    for (std::size_t first = 0; first < packet_capacity; first += hn::Lanes(d)) {
        const auto product = [&](const HalfSpace& plane, const double(&of)[3][packet_capacity]) HWY_ATTR {
            const auto part = [&](int axis) HWY_ATTR {
                return hn::Mul(hn::Set(d, plane.normal[axis]), hn::Load(d, of[axis] + first));
            };
            return hn::Add(hn::Add(part(0), part(1)), part(2));
        };
        V t_near = hn::Load(d, rays.t_near + first), t_far = hn::Load(d, rays.t_far + first);
        V entry = hn::Set(d, -1.0), exit = entry;
        auto outside = hn::FirstN(d, 0);
        double number = 0.0;
        for (const HalfSpace& plane : half_spaces) {
            const V distance = hn::Sub(hn::Set(d, plane.offset), product(plane, rays.origin));
            const V speed = product(plane, rays.direction);
            const V t = hn::Div(distance, speed);
            const auto comes_in = hn::Gt(speed, zero), goes_out = hn::Lt(speed, zero);
            const auto is_later = hn::And(comes_in, hn::Gt(t, t_near)),
                       is_earlier = hn::And(goes_out, hn::Lt(t, t_far));
            const auto same_entry = hn::And(comes_in, hn::And(hn::Eq(t, t_near), hn::Lt(entry, zero)));
            const auto same_exit = hn::And(goes_out, hn::And(hn::Eq(t, t_far), hn::Lt(exit, zero)));
            t_near = hn::IfThenElse(is_later, t, t_near);
            t_far = hn::IfThenElse(is_earlier, t, t_far);
            entry = hn::IfThenElse(hn::Or(is_later, same_entry), hn::Set(d, number), entry);
            exit = hn::IfThenElse(hn::Or(is_earlier, same_exit), hn::Set(d, number), exit);
            outside = hn::Or(outside, hn::And(hn::Eq(speed, zero), hn::Gt(distance, zero)));
            number += 1.0;
        }
        hn::Store(t_near, d, rays.t_near + first);
        hn::Store(t_far, d, rays.t_far + first);
        hn::Store(entry, d, through.entry + first);
        hn::Store(exit, d, through.exit + first);
        left |= to_lane_mask(d, hn::AndNot(outside, hn::Le(t_near, t_far)), first);
    }
    return left & lanes;
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(ClipPacket);

LaneMask clip(LatticeRayPacket& rays, LaneMask lanes, const std::vector<HalfSpace>& half_spaces,
              PlanesOfChords& through)
{
    return HWY_DYNAMIC_DISPATCH(ClipPacket)(rays, lanes, half_spaces, through);
}

} // namespace isospline
#endif
