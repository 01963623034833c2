// Refines the approximate root of a ray in a cell. Included once for each SIMD target.
#include "isospline/cell/value-inl.h"
#include "isospline/math/roots-inl.h"

#if defined(ISOSPLINE_CELL_REFINE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_REFINE_INL_H
#undef ISOSPLINE_CELL_REFINE_INL_H
#else
#define ISOSPLINE_CELL_REFINE_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// Rays with exactly one root in [t_near, t_far] each, one ray per lane; t is near the root, and slope is about the
/// derivative of f with respect to t there.
template <class V>
struct RootSearch {
    /// Starts from the root of single precision, between t_near and t_far.
    HWY_INLINE void begin(V near_limit, V far_limit, RootEstimate<V> estimate)
    {
        t_near = near_limit;
        t_far = far_limit;
        const V way = t_far - t_near;
        t = mul_add(estimate.s, way, t_near);
        slope = estimate.slope / way;
    }

    template <class Corner>
    HWY_INLINE std::array<V, 3> local(const Corner& lower) const
    {
        const auto along = [&](int axis)
                               HWY_ATTR { return origin[axis] + t * direction[axis] - in_lanes<V>(lower[axis]); };
        return {along(0), along(1), along(2)};
    }

    std::array<V, 3> origin, direction;
    V t_near, t_far, t, slope;
    std::array<V, 3> gradient;
};

/// Newton's method in double precision, with the given slope in the first step, until a step is below 1e-9 of a voxel:
/// the next step would be below rounding, and the gradient is that of the root. `lower` is the corner of the cell, in
/// all lanes or for each one. Returns the wanted lanes where it
/// converges within [t_near, t_far]; lanes that do not converge do not delay the others.
template <int Degree, class V, class Coefficients, class Corner>
HWY_INLINE MaskOf<V> refine_root(const Coefficients& coefficient, const Corner& lower, MaskOf<V> wanted,
                                 RootSearch<V>& search)
{
    constexpr int iteration_limit = 5;
    const hn::DFromV<V> d;
    V speed = hn::Zero(d);
    for (int axis = 0; axis < 3; ++axis) {
        speed = hn::Max(speed, hn::Abs(search.direction[axis]));
        search.gradient[axis] = hn::Zero(d);
    }
    search.t = search.t - value_in_cell<Degree>(coefficient, search.local(lower)) / search.slope;
    auto done = hn::Not(wanted);
    for (int iteration = 0; iteration < iteration_limit; ++iteration) {
        const auto [value, gradient] = value_and_gradient_in_cell<Degree>(coefficient, search.local(lower));
        V slope = gradient[0] * search.direction[0];
        slope = mul_add(gradient[1], search.direction[1], slope);
        slope = mul_add(gradient[2], search.direction[2], slope);
        const V step = value / slope;
        search.t = select(done, search.t, search.t - step);
        for (int axis = 0; axis < 3; ++axis)
            search.gradient[axis] = select(done, search.gradient[axis], gradient[axis]);
        done = either(done, less_equal(hn::Abs(step) * speed, number<V>(1e-9)));
        if (hn::AllTrue(d, done))
            break;
    }
    return both(both(done, wanted), both(less_equal(search.t_near, search.t), less_equal(search.t, search.t_far)));
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
