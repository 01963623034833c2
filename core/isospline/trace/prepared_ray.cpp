#include "isospline/trace/prepared_ray.h"

#include "isospline/math/affine.h"
#include "isospline/trace/check_ray.h"

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/prepared_ray.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/cell/lane_mask-inl.h"
#include "isospline/cell/lattice_line-inl.h"
#include "isospline/math/vector-inl.h"

#ifndef ISOSPLINE_TRACE_PREPARED_LANES
#define ISOSPLINE_TRACE_PREPARED_LANES
namespace isospline {

/// Margin for the rounding of about ten operations, in the preparation and in the test that predicts its result.
inline constexpr double miss_rounding = 32.0 * 0x1p-53;

// The result of preparing the rays of a packet.
struct PreparedLanes {
    LaneMask valid, inside;
};

} // namespace isospline
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Margin for the rounding of limits, relative to the numbers that they are computed from.
constexpr double limits_rounding = 8.0 * 0x1p-53;

/// The members of PreparedRay, except the original limits. If a ray is not valid, the rest has no meaning.
template <class N>
struct Preparation {
    Vector3<N> origin, direction;
    N t_near, t_far;
    N shift, length;
    MaskOf<N> valid;  ///< finite, with a direction
    MaskOf<N> inside; ///< and does not miss the box
};

template <class N>
HWY_INLINE Preparation<N> prepared(const Vector3<N>& origin, const Vector3<N>& direction, N near_limit, N far_limit,
                                   const RayFrame& frame)
{
    const N zero = number<N>(0.0), one = number<N>(1.0);
    Preparation<N> result;
    result.length = square_root(dot(direction, direction));
    // Zero times a number that is not finite is NaN, not zero.
    const auto finite_direction =
        both(less(zero, result.length), less_equal(result.length, number<N>(0x1.fffffffffffffp1023)));
    result.valid = both(finite_direction, equal(dot(origin, Vector3<N>{zero, zero, zero}), zero));

    const N scale = one / result.length;
    N t_near = number<N>(-huge_inverse), t_far = number<N>(huge_inverse);
    result.inside = result.valid;
    Vector3<N> rest;
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const N lower = number<N>(frame.box.lower[axis]), upper = number<N>(frame.box.upper[axis]);
        const N from = origin[a], to = number<N>(frame.centre[axis]);
        const N centred = from - to, back = centred - from;
        rest[a] = (from - (centred - back)) - (to + back); // the rounding error of the difference
        result.origin[a] = centred;
        result.direction[a] = direction[a] * scale;
        const auto parallel = less(absolute(result.direction[a]), number<N>(smallest_with_inverse));
        const auto outside = either(less(centred, lower), less(upper, centred));
        result.inside = without(result.inside, both(parallel, outside));
        const N inverse = one / result.direction[a];
        const N to_lower = (lower - centred) * inverse, to_upper = (upper - centred) * inverse;
        t_near = select(parallel, t_near, larger(t_near, smaller(to_lower, to_upper)));
        t_far = select(parallel, t_far, smaller(t_far, larger(to_lower, to_upper)));
    }
    result.shift = t_near * scale;
    const auto room = [&](N limit) HWY_ATTR {
        return number<N>(limits_rounding) * (absolute(limit) + absolute(result.shift)) * result.length;
    };
    result.t_near = larger(zero, (near_limit - result.shift) * result.length - room(near_limit));
    result.t_far = smaller(t_far - t_near, (far_limit - result.shift) * result.length + room(far_limit));
    result.inside = both(result.inside, less_equal(result.t_near, result.t_far));
    // With that error and a fused product, the start of the line is exact up to the rounding of a position in the
    // scene, however far away the eye is.
    for (std::size_t axis = 0; axis < 3; ++axis)
        result.origin[axis] = fused_mul_add(result.shift, direction[axis], result.origin[axis]) + rest[axis];
    return result;
}

using Doubles = hn::CappedTag<double, PreparedPacket::capacity>;

// Whether all rays are finite and miss the box by more than rounding. A line o + t d meets a box around the origin only
// if |o_y d_z - o_z d_y| <= h_y |d_z| + h_z |d_y|, and likewise for each pair of axes: the projections of the box and
// of the line along the third axis meet. A ray from t = 0 on misses the box if it begins outside of it and goes away
// from it along one axis. This test needs no division, unlike the preparation that it saves.
bool AllClearlyMiss(const RayPacket& rays, const glm::dvec3& centre, const Box& box)
{
    const Doubles d;
    using V = hn::Vec<Doubles>;
    const LaneMask all = (LaneMask{1} << rays.count) - 1u;
    for (std::size_t first = 0; first < static_cast<std::size_t>(rays.count); first += hn::Lanes(d)) {
        V origin[3], direction[3], reach[3], size[3], half_size[3];
        for (int axis = 0; axis < 3; ++axis) {
            origin[axis] = hn::Sub(hn::Load(d, rays.origin[axis] + first), hn::Set(d, centre[axis]));
            direction[axis] = hn::Load(d, rays.direction[axis] + first);
            size[axis] = hn::Abs(direction[axis]);
            half_size[axis] = hn::Set(d, box.upper[axis]);
            reach[axis] = hn::Add(hn::Abs(origin[axis]), half_size[axis]);
        }
        auto outside = hn::FirstN(d, 0), goes_away = outside;
        for (int axis = 0; axis < 3; ++axis) {
            const V beyond = hn::Sub(hn::Abs(origin[axis]), half_size[axis]);
            const auto begins_outside = hn::Gt(beyond, hn::Mul(reach[axis], hn::Set(d, miss_rounding)));
            const auto same_sign = hn::Gt(hn::Mul(origin[axis], direction[axis]), hn::Zero(d));
            goes_away = hn::Or(goes_away, hn::And(begins_outside, same_sign));
            const int a = (axis + 1) % 3, b = (axis + 2) % 3;
            const V moment = hn::Abs(hn::Sub(hn::Mul(origin[a], direction[b]), hn::Mul(origin[b], direction[a])));
            const V shadow = hn::Add(hn::Mul(half_size[a], size[b]), hn::Mul(half_size[b], size[a]));
            const V terms = hn::Add(hn::Mul(reach[a], size[b]), hn::Mul(reach[b], size[a]));
            const V room = hn::Add(hn::Mul(terms, hn::Set(d, miss_rounding)), hn::Set(d, 1e-300)); // or underflow
            outside = hn::Or(outside, hn::Gt(moment, hn::Add(shadow, room)));
        }
        const auto begins_at_origin = hn::Ge(hn::Load(d, rays.t_near + first), hn::Zero(d));
        outside = hn::Or(outside, hn::And(goes_away, begins_at_origin));
        const V largest = hn::Add(hn::Add(reach[0], reach[1]), reach[2]);
        const V length = hn::Add(hn::Add(size[0], size[1]), size[2]);
        const V least = hn::Set(d, 1e-150), most = hn::Set(d, 1e150); // whose squares are finite and not zero
        const auto valid = hn::And(hn::And(hn::Gt(length, least), hn::Lt(length, most)), hn::Lt(largest, most));
        const LaneMask misses = to_lane_mask(d, hn::And(outside, valid), first);
        if ((all & all_lanes(d) << first & ~misses) != 0)
            return false;
    }
    return true;
}

// Results of rays that are not valid have no meaning.
PreparedLanes PreparePacket(const RayPacket& rays, const RayFrame& frame, PreparedPacket& packet)
{
    packet.count = rays.count;
    const LaneMask all = (LaneMask{1} << rays.count) - 1u;
    if (AllClearlyMiss(rays, frame.centre, frame.box))
        return {all, 0};

    const Doubles d;
    using V = hn::Vec<Doubles>;
    PreparedLanes lanes{0, 0};
    for (std::size_t first = 0; first < static_cast<std::size_t>(rays.count); first += hn::Lanes(d)) {
        const auto load = [&](const double(&from)[3][RayPacket::capacity]) HWY_ATTR {
            return Vector3<V>{hn::Load(d, from[0] + first), hn::Load(d, from[1] + first), hn::Load(d, from[2] + first)};
        };
        const V t_near = hn::Load(d, rays.t_near + first), t_far = hn::Load(d, rays.t_far + first);
        const auto ready = prepared(load(rays.origin), load(rays.direction), t_near, t_far, frame);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            hn::Store(ready.origin[axis], d, packet.origin[axis] + first);
            hn::Store(ready.direction[axis], d, packet.direction[axis] + first);
        }
        hn::Store(ready.t_near, d, packet.t_near + first);
        hn::Store(ready.t_far, d, packet.t_far + first);
        hn::Store(t_near, d, packet.limits.t_near + first);
        hn::Store(t_far, d, packet.limits.t_far + first);
        hn::Store(ready.shift, d, packet.limits.shift + first);
        hn::Store(ready.length, d, packet.limits.length + first);
        lanes.valid |= to_lane_mask(d, ready.valid, first);
        lanes.inside |= to_lane_mask(d, ready.inside, first);
    }
    return lanes;
}

void ToLattice(const PreparedPacket& packet, const glm::dmat4& map, const glm::ivec3& shape, LatticeRayPacket& rays)
{
    const Doubles d;
    const hn::Rebind<float, Doubles> to_float;
    using V = hn::Vec<Doubles>;
    const V limit = hn::Set(d, huge_inverse_single);
    for (std::size_t first = 0; first < static_cast<std::size_t>(packet.count); first += hn::Lanes(d)) {
        const auto copy = [&](const double* from, double* to)
                              HWY_ATTR { hn::Store(hn::Load(d, from + first), d, to + first); };
        const auto load = [&](const double(&from)[3][PreparedPacket::capacity]) HWY_ATTR {
            return Vector3<V>{hn::Load(d, from[0] + first), hn::Load(d, from[1] + first), hn::Load(d, from[2] + first)};
        };
        const Vector3<V> origin = transformed(map, load(packet.origin), 1.0);
        const Vector3<V> direction = transformed(map, load(packet.direction), 0.0);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto line = lattice_line(origin[axis], direction[axis], shape[static_cast<int>(axis)]);
            hn::Store(origin[axis], d, rays.origin[axis] + first);
            hn::Store(line.plane_origin, d, rays.plane_origin[axis] + first);
            hn::Store(direction[axis], d, rays.direction[axis] + first);
            hn::Store(line.inverse_direction, d, rays.inverse_direction[axis] + first);
            hn::Store(hn::DemoteTo(to_float, direction[axis]), to_float, rays.direction_single[axis] + first);
            const V limited = hn::Max(hn::Min(line.inverse_direction, limit), hn::Neg(limit));
            hn::Store(hn::DemoteTo(to_float, limited), to_float, rays.inverse_direction_single[axis] + first);
        }
        copy(packet.t_near, rays.t_near);
        copy(packet.t_far, rays.t_far);
        copy(packet.limits.shift, rays.limits.shift);
        copy(packet.limits.length, rays.limits.length);
        copy(packet.limits.t_near, rays.limits.t_near);
        copy(packet.limits.t_far, rays.limits.t_far);
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(PreparePacket);
HWY_EXPORT(ToLattice);

RayFrame::RayFrame(const Box& bounds, const glm::dvec3& about) : centre(about)
{
    if (bounds.empty())
        return;
    const glm::dvec3 lower = bounds.lower - centre, upper = bounds.upper - centre;
    radius = glm::length(glm::max(glm::abs(lower), glm::abs(upper)));
    box = {lower - 1e-3 * radius, upper + 1e-3 * radius};
}

glm::dmat4 centred_to_local(const glm::dmat4& local_to_world, const RayFrame& frame)
{
    return glm::inverse(glm::translate(glm::dmat4(1.0), -frame.centre) * local_to_world);
}

bool prepare(const Ray& ray, std::size_t index, const RayFrame& frame, PreparedRay& result)
{
    check_ray(ray, index);
    if (frame.box.empty())
        return false;
    const auto ready = scalar::prepared(scalar::constant_vector<double>(ray.origin),
                                        scalar::constant_vector<double>(ray.direction), ray.t_near, ray.t_far, frame);
    result.ray = {{ready.origin[0], ready.origin[1], ready.origin[2]},
                  {ready.direction[0], ready.direction[1], ready.direction[2]},
                  ready.t_near,
                  ready.t_far};
    result.limits = {ready.shift, ready.length, ray.t_near, ray.t_far};
    return ready.inside;
}

LaneMask prepare_packet(const RayPacket& rays, std::size_t index, const RayFrame& frame, PreparedPacket& packet)
{
    const LaneMask wanted = (LaneMask{1} << rays.count) - 1u;
    const PreparedLanes lanes = HWY_DYNAMIC_DISPATCH(PreparePacket)(rays, frame, packet);
    for (LaneMask rest = wanted & ~lanes.valid; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        check_ray(rays.ray(lane), index + static_cast<std::size_t>(lane));
    }
    return frame.box.empty() ? 0 : lanes.inside & wanted;
}

LatticeRay to_lattice(const PreparedRay& ready, const glm::dmat4& centred_to_lattice, const glm::ivec3& shape)
{
    LatticeRay ray({transform_point(centred_to_lattice, ready.ray.origin),
                    transform_vector(centred_to_lattice, ready.ray.direction), ready.ray.t_near, ready.ray.t_far},
                   shape);
    ray.limits = ready.limits;
    return ray;
}

void to_lattice(const PreparedPacket& packet, const glm::dmat4& centred_to_lattice, const glm::ivec3& shape,
                LatticeRayPacket& rays)
{
    HWY_DYNAMIC_DISPATCH(ToLattice)(packet, centred_to_lattice, shape, rays);
}

} // namespace isospline
#endif
