#include "isospline/scene/prepared_ray.h"

#include "isospline/trace/check_ray.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/scene/prepared_ray.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/trace/lane_mask-inl.h"

#ifndef ISOSPLINE_SCENE_PREPARATION
#define ISOSPLINE_SCENE_PREPARATION
namespace isospline {

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

// The operations of prepare(), in its order. Rays that are not valid have no meaning afterwards.
Preparation PreparePacket(std::span<const Ray> rays, const glm::dvec3& centre, const Box& box, PreparedPacket& prepared)
{
    // Axis by axis; lanes beyond the rays repeat the last one.
    alignas(64) double near_limit[PreparedPacket::capacity];
    for (std::size_t lane = 0; lane < PreparedPacket::capacity; ++lane) {
        const Ray& ray = rays[std::min(lane, rays.size() - 1)];
        for (int axis = 0; axis < 3; ++axis) {
            prepared.origin[axis][lane] = ray.origin[axis];
            prepared.direction[axis][lane] = ray.direction[axis];
        }
        near_limit[lane] = ray.t_near;
        prepared.t_far[lane] = ray.t_far;
    }

    const Doubles d;
    using V = hn::Vec<Doubles>;
    const V zero = hn::Zero(d);
    Preparation preparation{0, 0};
    for (std::size_t first = 0; first < PreparedPacket::capacity; first += hn::Lanes(d)) {
        V origin[3], direction[3], given_direction[3], rest[3];
        for (int axis = 0; axis < 3; ++axis) {
            origin[axis] = hn::Load(d, prepared.origin[axis] + first);
            direction[axis] = hn::Load(d, prepared.direction[axis] + first);
        }
        const auto dot = [](const V(&a)[3], const V(&b)[3]) HWY_ATTR {
            return hn::Add(hn::Add(hn::Mul(a[0], b[0]), hn::Mul(a[1], b[1])), hn::Mul(a[2], b[2]));
        };
        const V length = hn::Sqrt(dot(direction, direction));
        const V zeros[3] = {zero, zero, zero};
        const auto finite = hn::And(hn::And(hn::Gt(length, zero), hn::Le(length, hn::Set(d, 0x1.fffffffffffffp1023))),
                                    hn::Eq(dot(origin, zeros), zero));

        const V scale = hn::Div(hn::Set(d, 1.0), length);
        V t_near = hn::Mul(hn::Load(d, near_limit + first), length);
        V t_far = hn::Mul(hn::Load(d, prepared.t_far + first), length);
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
        inside = hn::And(inside, hn::Le(t_near, t_far));
        const V shift = hn::Mul(t_near, scale);
        for (int axis = 0; axis < 3; ++axis) {
            const V begin = hn::Add(FusedMulAdd(shift, given_direction[axis], origin[axis]), rest[axis]);
            hn::Store(begin, d, prepared.origin[axis] + first);
            hn::Store(direction[axis], d, prepared.direction[axis] + first);
        }
        hn::Store(hn::Sub(t_far, t_near), d, prepared.t_far + first);
        hn::Store(shift, d, prepared.shift + first);
        hn::Store(length, d, prepared.length + first);
        preparation.valid |= ToLaneMask(d, finite, first);
        preparation.inside |= ToLaneMask(d, inside, first);
    }
    return preparation;
}

// The operations of LatticeRay and of GLM's product of matrix and vector, in their order.
void ToLattice(const PreparedPacket& prepared, const glm::dmat4& map, LatticeRayPacket& rays)
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
            hn::Store(transformed(prepared.origin, axis, 1.0), d, rays.origin[axis] + first);
            hn::Store(direction, d, rays.direction[axis] + first);
            hn::Store(inverse, d, rays.inverse_direction[axis] + first);
            hn::Store(hn::DemoteTo(to_float, direction), to_float, rays.direction_single[axis] + first);
            hn::Store(hn::DemoteTo(to_float, hn::Max(hn::Min(inverse, limit), hn::Neg(limit))), to_float,
                      rays.inverse_direction_single[axis] + first);
        }
        hn::Store(hn::Zero(d), d, rays.t_near + first);
        hn::Store(hn::Load(d, prepared.t_far + first), d, rays.t_far + first);
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(PreparePacket);
HWY_EXPORT(ToLattice);

bool prepare(const Ray& ray, std::size_t index, const glm::dvec3& centre, const Box& box, PreparedRay& prepared)
{
    const double length = check_ray(ray, index);
    if (box.empty())
        return false;
    Ray& unit = prepared.ray;
    const double scale = 1.0 / length;
    unit.origin = ray.origin - centre;
    unit.direction = ray.direction * scale;
    unit.t_near = ray.t_near * length;
    unit.t_far = ray.t_far * length;
    const std::optional<Interval> inside = clip(unit, box);
    if (!inside)
        return false;
    prepared.shift = inside->t_near * scale;
    prepared.length = length;
    for (int axis = 0; axis < 3; ++axis) {
        // What rounding took from the difference, and a fused product: the ray begins where it does up to the rounding
        // of a place in the scene, however far the eye is away.
        const double from = ray.origin[axis], to = centre[axis];
        const double back = unit.origin[axis] - from;
        const double rest = (from - (unit.origin[axis] - back)) - (to + back);
        unit.origin[axis] = std::fma(prepared.shift, ray.direction[axis], unit.origin[axis]) + rest;
    }
    unit.t_near = 0.0;
    unit.t_far = inside->t_far - inside->t_near;
    return true;
}

LaneMask prepare_packet(std::span<const Ray> rays, std::size_t index, const glm::dvec3& centre, const Box& box,
                        PreparedPacket& prepared)
{
    const LaneMask wanted = (LaneMask{1} << rays.size()) - 1u;
    const Preparation preparation = HWY_DYNAMIC_DISPATCH(PreparePacket)(rays, centre, box, prepared);
    for (LaneMask rest = wanted & ~preparation.valid; rest != 0; rest &= rest - 1u) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(rest));
        check_ray(rays[lane], index + lane);
    }
    return box.empty() ? 0 : preparation.inside & wanted;
}

void to_lattice(const PreparedPacket& prepared, const glm::dmat4& world_to_lattice, LatticeRayPacket& rays)
{
    HWY_DYNAMIC_DISPATCH(ToLattice)(prepared, world_to_lattice, rays);
}

} // namespace isospline
#endif
