// Preparation of rays, for one ray or for one ray per SIMD lane. Included once for each SIMD target.
#include "isospline/cell/lattice_ray.h"
#include "isospline/math/vector-inl.h"
#include "isospline/trace/prepared_ray.h"

#if defined(ISOSPLINE_TRACE_PREPARATION_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_PREPARATION_INL_H
#undef ISOSPLINE_TRACE_PREPARATION_INL_H
#else
#define ISOSPLINE_TRACE_PREPARATION_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

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

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
