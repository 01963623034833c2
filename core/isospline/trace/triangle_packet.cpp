#include "isospline/trace/triangle_packet.h"

#include <bit>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/triangle_packet.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/cell/lane_mask-inl.h"

#ifndef ISOSPLINE_TRACE_SURE_PASSAGES
#define ISOSPLINE_TRACE_SURE_PASSAGES
namespace isospline {

// The passages that double precision decides, and the lanes where it cannot.
struct SurePassages {
    LanePassages passages;
    LaneMask unsure = 0;
};

} // namespace isospline
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, TriangleRayPacket::capacity>;

struct Vectors {
    hn::Vec<Doubles> x, y, z;
};

HWY_INLINE Vectors Difference(const glm::dvec3& to, const Vectors& from)
{
    const Doubles d;
    return {hn::Sub(hn::Set(d, to.x), from.x), hn::Sub(hn::Set(d, to.y), from.y), hn::Sub(hn::Set(d, to.z), from.z)};
}

HWY_INLINE Vectors Load(const double (&from)[3][TriangleRayPacket::capacity], std::size_t first)
{
    const Doubles d;
    return {hn::Load(d, from[0] + first), hn::Load(d, from[1] + first), hn::Load(d, from[2] + first)};
}

HWY_INLINE hn::Vec<Doubles> Determinant(const Vectors& a, const Vectors& b, const Vectors& c)
{
    const auto x = hn::Mul(hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)), c.x);
    const auto y = hn::Mul(hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)), c.y);
    const auto z = hn::Mul(hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x)), c.z);
    return hn::Add(hn::Add(x, y), z);
}

HWY_INLINE hn::Vec<Doubles> Size(const Vectors& v)
{
    return hn::Max(hn::Max(hn::Abs(v.x), hn::Abs(v.y)), hn::Abs(v.z));
}

SurePassages FindSurePassages(const TriangleRayPacket& rays, const Triangle& triangle, LaneMask lanes)
{
    const Doubles d;
    SurePassages found;
    for (std::size_t first = 0; first < TriangleRayPacket::capacity; first += hn::Lanes(d)) {
        if ((lanes >> first & all_lanes(d)) == 0)
            continue;
        const Vectors origin = Load(rays.origin, first), direction = Load(rays.direction, first);
        const Vectors a = Difference(triangle.a, origin), b = Difference(triangle.b, origin),
                      c = Difference(triangle.c, origin);
        const auto past_a = Determinant(direction, b, c), past_b = Determinant(direction, c, a),
                   past_c = Determinant(direction, a, b);
        const auto least = hn::Min(hn::Min(past_a, past_b), past_c);
        const auto largest = hn::Max(hn::Max(past_a, past_b), past_c);
        const auto extent = hn::Max(hn::Max(Size(a), Size(b)), Size(c));
        const auto error = hn::Mul(hn::Set(d, edge_function_error), hn::Mul(extent, extent));
        const LaneMask above = to_lane_mask(d, hn::Gt(least, error), first);
        const LaneMask below = to_lane_mask(d, hn::Lt(largest, hn::Neg(error)), first);
        const LaneMask outside = to_lane_mask(d, hn::And(hn::Lt(least, hn::Neg(error)), hn::Gt(largest, error)), first);
        const LaneMask all = lanes & all_lanes(d) << first;
        found.passages.along_normal |= above & all;
        found.passages.against_normal |= below & all;
        found.unsure |= all & ~(above | below | outside);
    }
    return found;
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(FindSurePassages);

LanePassages passages(const TriangleRayPacket& rays, const Triangle& triangle, LaneMask lanes)
{
    auto [found, unsure] = HWY_DYNAMIC_DISPATCH(FindSurePassages)(rays, triangle, lanes);
    for (; unsure != 0; unsure &= unsure - 1u) {
        const int lane = std::countr_zero(unsure);
        const TriangleRay ray = rays.ray(lane);
        const Passage passage = exact_passage(ray.origin, ray.direction, triangle);
        found.along_normal |= static_cast<LaneMask>(passage == Passage::along_normal) << lane;
        found.against_normal |= static_cast<LaneMask>(passage == Passage::against_normal) << lane;
    }
    return found;
}

} // namespace isospline
#endif
