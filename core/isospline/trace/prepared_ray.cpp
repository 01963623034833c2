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

#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/prepared_ray.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/cell/lane_mask-inl.h"

#ifndef ISOSPLINE_TRACE_PREPARATION
#define ISOSPLINE_TRACE_PREPARATION
namespace isospline {

/// Room for the rounding of limits, relative to the numbers that they are computed from.
inline constexpr double limits_rounding = 8.0 * 0x1p-53;

/// Room for the rounding of some ten operations, of prepare() and of what foretells its result.
inline constexpr double miss_rounding = 32.0 * 0x1p-53;

// What came of the rays of a packet.
struct Preparation {
    LaneMask valid, inside;
};

} // namespace isospline
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, PreparedPacket::capacity>;

// a * b + c with one rounding, whether the target has an instruction for it or not.
HWY_INLINE hn::Vec<Doubles> FusedMulAdd(hn::Vec<Doubles> a, hn::Vec<Doubles> b, hn::Vec<Doubles> c)
{
#if HWY_NATIVE_FMA
    return hn::MulAdd(a, b, c);
#else
    const Doubles d;
    alignas(64) double factors[2][hn::MaxLanes(d)], sums[hn::MaxLanes(d)];
    hn::Store(a, d, factors[0]);
    hn::Store(b, d, factors[1]);
    hn::Store(c, d, sums);
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane)
        sums[lane] = std::fma(factors[0][lane], factors[1][lane], sums[lane]);
    return hn::Load(d, sums);
#endif
}

// Lanes whose rays are finite and whose lines miss the box, by more than rounding can make of it. A line o + t d
// meets a box about the origin only if |o_y d_z - o_z d_y| <= h_y |d_z| + h_z |d_y|, and so for each pair of axes: the
// box's and the line's shadow along the third one meet. There is no division in it, unlike in what it saves.
LaneMask ClearMisses(const RayPacket& rays, const glm::dvec3& centre, const Box& box)
{
    const Doubles d;
    using V = hn::Vec<Doubles>;
    LaneMask misses = 0;
    for (std::size_t first = 0; first < static_cast<std::size_t>(rays.count); first += hn::Lanes(d)) {
        V origin[3], direction[3], reach[3], size[3], half_size[3];
        for (int axis = 0; axis < 3; ++axis) {
            origin[axis] = hn::Sub(hn::Load(d, rays.origin[axis] + first), hn::Set(d, centre[axis]));
            direction[axis] = hn::Load(d, rays.direction[axis] + first);
            size[axis] = hn::Abs(direction[axis]);
            half_size[axis] = hn::Set(d, box.upper[axis]);
            reach[axis] = hn::Add(hn::Abs(origin[axis]), half_size[axis]);
        }
        auto outside = hn::FirstN(d, 0);
        for (int axis = 0; axis < 3; ++axis) {
            const int a = (axis + 1) % 3, b = (axis + 2) % 3;
            const V moment = hn::Abs(hn::Sub(hn::Mul(origin[a], direction[b]), hn::Mul(origin[b], direction[a])));
            const V shadow = hn::Add(hn::Mul(half_size[a], size[b]), hn::Mul(half_size[b], size[a]));
            const V terms = hn::Add(hn::Mul(reach[a], size[b]), hn::Mul(reach[b], size[a]));
            const V room = hn::Add(hn::Mul(terms, hn::Set(d, miss_rounding)), hn::Set(d, 1e-300)); // or underflow
            outside = hn::Or(outside, hn::Gt(moment, hn::Add(shadow, room)));
        }
        const V largest = hn::Add(hn::Add(reach[0], reach[1]), reach[2]);
        const V length = hn::Add(hn::Add(size[0], size[1]), size[2]);
        const V least = hn::Set(d, 1e-150), most = hn::Set(d, 1e150); // whose squares are finite and not zero
        const auto valid = hn::And(hn::And(hn::Gt(length, least), hn::Lt(length, most)), hn::Lt(largest, most));
        misses |= to_lane_mask(d, hn::And(outside, valid), first);
    }
    return misses;
}

// The operations of prepare(), in its order. Rays that are not valid have no meaning afterwards.
Preparation PreparePacket(const RayPacket& rays, const glm::dvec3& centre, const Box& box, PreparedPacket& prepared)
{
    const LaneMask all = (LaneMask{1} << rays.count) - 1u;
    if ((ClearMisses(rays, centre, box) & all) == all)
        return {all, 0};

    const Doubles d;
    using V = hn::Vec<Doubles>;
    const V zero = hn::Zero(d);
    Preparation preparation{0, 0};
    const auto count = static_cast<std::size_t>(rays.count);
    for (std::size_t first = 0; first < count; first += hn::Lanes(d)) {
        V origin[3], direction[3], given_direction[3], rest[3];
        for (int axis = 0; axis < 3; ++axis) {
            origin[axis] = hn::Load(d, rays.origin[axis] + first);
            direction[axis] = hn::Load(d, rays.direction[axis] + first);
        }
        const auto dot = [](const V(&a)[3], const V(&b)[3]) HWY_ATTR {
            return hn::Add(hn::Add(hn::Mul(a[0], b[0]), hn::Mul(a[1], b[1])), hn::Mul(a[2], b[2]));
        };
        const V length = hn::Sqrt(dot(direction, direction));
        const V zeros[3] = {zero, zero, zero};
        const auto finite = hn::And(hn::And(hn::Gt(length, zero), hn::Le(length, hn::Set(d, 0x1.fffffffffffffp1023))),
                                    hn::Eq(dot(origin, zeros), zero));

        const V scale = hn::Div(hn::Set(d, 1.0), length);
        V t_near = hn::Set(d, -huge_inverse), t_far = hn::Set(d, huge_inverse);
        auto inside = finite;
        for (int axis = 0; axis < 3; ++axis) {
            const V lower = hn::Set(d, box.lower[axis]), upper = hn::Set(d, box.upper[axis]);
            const V from = origin[axis], to = hn::Set(d, centre[axis]);
            origin[axis] = hn::Sub(from, to);
            const V back = hn::Sub(origin[axis], from);
            rest[axis] = hn::Sub(hn::Sub(from, hn::Sub(origin[axis], back)), hn::Add(to, back));
            given_direction[axis] = direction[axis];
            direction[axis] = hn::Mul(direction[axis], scale);
            const auto parallel = hn::Lt(hn::Abs(direction[axis]), hn::Set(d, smallest_with_inverse));
            const auto outside = hn::Or(hn::Lt(origin[axis], lower), hn::Gt(origin[axis], upper));
            inside = hn::AndNot(hn::And(parallel, outside), inside);
            const V inverse = hn::Div(hn::Set(d, 1.0), direction[axis]);
            const V to_lower = hn::Mul(hn::Sub(lower, origin[axis]), inverse);
            const V to_upper = hn::Mul(hn::Sub(upper, origin[axis]), inverse);
            t_near = hn::IfThenElse(parallel, t_near, hn::Max(t_near, hn::Min(to_lower, to_upper)));
            t_far = hn::IfThenElse(parallel, t_far, hn::Min(t_far, hn::Max(to_lower, to_upper)));
        }
        const V shift = hn::Mul(t_near, scale);
        const V near_limit = hn::Load(d, rays.t_near + first);
        const V far_limit = hn::Load(d, rays.t_far + first);
        const auto room = [&](V limit) HWY_ATTR {
            return hn::Mul(hn::Mul(hn::Set(d, limits_rounding), hn::Add(hn::Abs(limit), hn::Abs(shift))), length);
        };
        const V begin_limit = hn::Sub(hn::Mul(hn::Sub(near_limit, shift), length), room(near_limit));
        const V end_limit = hn::Add(hn::Mul(hn::Sub(far_limit, shift), length), room(far_limit));
        t_far = hn::Min(hn::Sub(t_far, t_near), end_limit);
        t_near = hn::Max(zero, begin_limit);
        inside = hn::And(inside, hn::Le(t_near, t_far));
        for (int axis = 0; axis < 3; ++axis) {
            const V begin = hn::Add(FusedMulAdd(shift, given_direction[axis], origin[axis]), rest[axis]);
            hn::Store(begin, d, prepared.origin[axis] + first);
            hn::Store(direction[axis], d, prepared.direction[axis] + first);
        }
        hn::Store(t_near, d, prepared.t_near + first);
        hn::Store(t_far, d, prepared.t_far + first);
        hn::Store(near_limit, d, prepared.limits.t_near + first);
        hn::Store(far_limit, d, prepared.limits.t_far + first);
        hn::Store(shift, d, prepared.limits.shift + first);
        hn::Store(length, d, prepared.limits.length + first);
        preparation.valid |= to_lane_mask(d, finite, first);
        preparation.inside |= to_lane_mask(d, inside, first);
    }
    return preparation;
}

// The operations of LatticeRay and of GLM's product of matrix and vector, in their order.
void ToLattice(const PreparedPacket& prepared, const glm::dmat4& map, const glm::ivec3& shape, LatticeRayPacket& rays)
{
    const Doubles d;
    const hn::Rebind<float, Doubles> to_float;
    using V = hn::Vec<Doubles>;
    for (std::size_t first = 0; first < PreparedPacket::capacity; first += hn::Lanes(d)) {
        const auto transformed = [&](const double(&from)[3][PreparedPacket::capacity], int row, double w) HWY_ATTR {
            const V x = hn::Mul(hn::Set(d, map[0][row]), hn::Load(d, from[0] + first));
            const V y = hn::Mul(hn::Set(d, map[1][row]), hn::Load(d, from[1] + first));
            const V z = hn::Mul(hn::Set(d, map[2][row]), hn::Load(d, from[2] + first));
            return hn::Add(hn::Add(x, y), hn::Add(z, hn::Set(d, map[3][row] * w)));
        };
        for (int axis = 0; axis < 3; ++axis) {
            const V direction = transformed(prepared.direction, axis, 0.0);
            const V huge = hn::Set(d, huge_inverse), limit = hn::Set(d, huge_inverse_single);
            const auto has_inverse = hn::Gt(hn::Abs(direction), hn::Set(d, 1.0 / huge_inverse));
            const V inverse =
                hn::IfThenElse(has_inverse, hn::Div(hn::Set(d, 1.0), direction), hn::CopySign(huge, direction));
            const V origin = transformed(prepared.origin, axis, 1.0), half = hn::Set(d, 0.5);
            const auto at_border = hn::Eq(origin, hn::Set(d, static_cast<double>(shape[axis])));
            const V below = hn::IfThenElseZero(at_border, hn::Set(d, 1.0));
            const V middle = hn::Add(hn::Sub(hn::Floor(origin), below), half);
            hn::Store(origin, d, rays.origin[axis] + first);
            hn::Store(hn::IfThenElse(has_inverse, origin, middle), d, rays.plane_origin[axis] + first);
            hn::Store(direction, d, rays.direction[axis] + first);
            hn::Store(inverse, d, rays.inverse_direction[axis] + first);
            hn::Store(hn::DemoteTo(to_float, direction), to_float, rays.direction_single[axis] + first);
            hn::Store(hn::DemoteTo(to_float, hn::Max(hn::Min(inverse, limit), hn::Neg(limit))), to_float,
                      rays.inverse_direction_single[axis] + first);
        }
    }
    std::copy_n(prepared.t_near, PreparedPacket::capacity, rays.t_near);
    std::copy_n(prepared.t_far, PreparedPacket::capacity, rays.t_far);
    rays.limits = prepared.limits;
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(PreparePacket);
HWY_EXPORT(ToLattice);

RayFrame::RayFrame(const Box& bounds)
{
    if (bounds.empty())
        return;
    centre = bounds.center();
    radius = 0.5 * glm::length(bounds.size());
    const glm::dvec3 half_size = 0.5 * bounds.size() + 1e-3 * radius;
    box = {-half_size, half_size};
}

glm::dmat4 centred_to_local(const glm::dmat4& local_to_world, const RayFrame& frame)
{
    return glm::inverse(glm::translate(glm::dmat4(1.0), -frame.centre) * local_to_world);
}

bool prepare(const Ray& ray, std::size_t index, const RayFrame& frame, PreparedRay& prepared)
{
    const double length = check_ray(ray, index);
    if (frame.box.empty())
        return false;
    Ray& unit = prepared.ray;
    const double scale = 1.0 / length;
    unit.origin = ray.origin - frame.centre;
    unit.direction = ray.direction * scale;
    unit.t_near = -huge_inverse;
    unit.t_far = huge_inverse;
    const std::optional<Interval> inside = clip(unit, frame.box);
    if (!inside)
        return false;

    const double shift = inside->t_near * scale;
    const auto room = [&](double limit) { return limits_rounding * (std::abs(limit) + std::abs(shift)) * length; };
    unit.t_far = std::min(inside->t_far - inside->t_near, (ray.t_far - shift) * length + room(ray.t_far));
    unit.t_near = std::max(0.0, (ray.t_near - shift) * length - room(ray.t_near));
    prepared.limits = {shift, length, ray.t_near, ray.t_far};
    for (int axis = 0; axis < 3; ++axis) {
        // What rounding took from the difference, and a fused product: the line begins where it does up to the rounding
        // of a place in the scene, however far the eye is away.
        const double from = ray.origin[axis], to = frame.centre[axis];
        const double back = unit.origin[axis] - from;
        const double rest = (from - (unit.origin[axis] - back)) - (to + back);
        unit.origin[axis] = std::fma(shift, ray.direction[axis], unit.origin[axis]) + rest;
    }
    return unit.t_near <= unit.t_far;
}

LaneMask prepare_packet(const RayPacket& rays, std::size_t index, const RayFrame& frame, PreparedPacket& prepared)
{
    const LaneMask wanted = (LaneMask{1} << rays.count) - 1u;
    const Preparation preparation = HWY_DYNAMIC_DISPATCH(PreparePacket)(rays, frame.centre, frame.box, prepared);
    for (LaneMask rest = wanted & ~preparation.valid; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        check_ray(rays.ray(lane), index + static_cast<std::size_t>(lane));
    }
    return frame.box.empty() ? 0 : preparation.inside & wanted;
}

LatticeRay to_lattice(const PreparedRay& prepared, const glm::dmat4& centred_to_lattice, const glm::ivec3& shape)
{
    LatticeRay ray;
    ray.set(transform_point(centred_to_lattice, prepared.ray.origin),
            transform_vector(centred_to_lattice, prepared.ray.direction), shape);
    ray.t_near = prepared.ray.t_near;
    ray.t_far = prepared.ray.t_far;
    ray.limits = prepared.limits;
    return ray;
}

void to_lattice(const PreparedPacket& prepared, const glm::dmat4& centred_to_lattice, const glm::ivec3& shape,
                LatticeRayPacket& rays)
{
    HWY_DYNAMIC_DISPATCH(ToLattice)(prepared, centred_to_lattice, shape, rays);
}

} // namespace isospline
#endif
