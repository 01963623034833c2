// The lines of a packet's rays in lattice space, with proven bounds: docs/method.md, "Certified rays". Included once
// for each SIMD target.
#include "isospline/cell/lane_mask-inl.h"
#include "isospline/math/number-inl.h"
#include "isospline/math/vector-inl.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/certified_placement.h"
#include "isospline/trace/ray_packet.h"

#include <cmath>
#include <cstddef>

#if defined(ISOSPLINE_TRACE_CERTIFIED_LINES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_CERTIFIED_LINES_INL_H
#undef ISOSPLINE_TRACE_CERTIFIED_LINES_INL_H
#else
#define ISOSPLINE_TRACE_CERTIFIED_LINES_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

using CertifiedDoubles = hn::CappedTag<double, 8>;
using CertifiedNumber = hn::Vec<CertifiedDoubles>;
constexpr std::size_t certified_width = hn::MaxLanes(CertifiedDoubles());

/// The lines of the lanes of a packet. Points of a line are start + t along, computed with two roundings.
class CertifiedLines {
public:
    CertifiedLines(const IsosurfaceSnapshot& surface, const certified::Placement& placement, const RayPacket& rays,
                   LaneMask lanes)
    {
        for (std::size_t first = 0; first < static_cast<std::size_t>(rays.count); first += certified_width)
            set(surface, placement, rays, first);
        usable_ &= lanes;
        outside_ &= lanes;
    }

    /// Lanes whose rays have a part in the domain, with bounds.
    LaneMask usable() const { return usable_; }
    /// Lanes whose rays are proven not to meet the domain.
    LaneMask outside() const { return outside_; }

    alignas(64) double start[3][packet_capacity], along[3][packet_capacity];
    alignas(64) double inverse[3][packet_capacity]; ///< of along; 0 if the line is nearly parallel to the planes
    /// The part in the domain: [begin, end] contains it, and it contains [sure_begin, sure_end].
    alignas(64) double begin[packet_capacity], end[packet_capacity];
    alignas(64) double sure_begin[packet_capacity], sure_end[packet_capacity];
    alignas(64) double point_error[packet_capacity]; ///< of points of the part, summed over the axes
    alignas(64) double value_error[packet_capacity]; ///< of f there, and of the threshold
    alignas(64) double speed[packet_capacity]; ///< a bound on the absolute values of `along`, summed over the axes

private:
    using N = CertifiedNumber;

    HWY_INLINE void set(const IsosurfaceSnapshot& surface, const certified::Placement& placement, const RayPacket& rays,
                        std::size_t first)
    {
        const CertifiedDoubles d;
        Vector3<N> from, direction;
        for (std::size_t j = 0; j < 3; ++j) {
            from[j] = hn::Load(d, rays.origin[j] + first) - number<N>(placement.origin[j].value);
            direction[j] = hn::Load(d, rays.direction[j] + first);
        }
        const N shift = number<N>(surface.volume().lattice_shift()), zero = number<N>(0.0);
        N near = hn::Load(d, rays.t_near + first), far = hn::Load(d, rays.t_far + first);
        N sure_near = near, sure_far = far;
        Vector3<N> start_error, along_error;
        Vector3<hn::Mask<CertifiedDoubles>> is_parallel;
        for (std::size_t i = 0; i < 3; ++i) {
            N at = shift, by = zero, at_error = number<N>(placement.origin_error[i]), by_error = zero;
            for (std::size_t j = 0; j < 3; ++j) {
                const N entry = number<N>(placement.to_lattice[i][j].value);
                const N error = number<N>(placement.product_error[i][j]);
                at = at + entry * from[j];
                by = by + entry * direction[j];
                at_error = at_error + error * absolute(from[j]);
                by_error = by_error + error * absolute(direction[j]);
            }
            at_error = (at_error + number<N>(0x1p-51) * absolute(at)) * number<N>(1.0 + 0x1p-40);
            by_error = by_error * number<N>(1.0 + 0x1p-40);

            const auto is_crossed = less(number<N>(0x1p20) * by_error, absolute(by));
            const N over = select(is_crossed, number<N>(1.0) / by, zero);
            const N to_upper = number<N>(surface.volume().cell_shape()[static_cast<int>(i)]) - at;
            const N t_lower = negated(at) * over, t_upper = to_upper * over;
            const N upper_error = at_error + number<N>(0x1p-52) * absolute(to_upper);
            const N t_lower_error = error_of_quotient(t_lower, at_error, by_error, over);
            const N t_upper_error = error_of_quotient(t_upper, upper_error, by_error, over);
            const auto is_forward = less(zero, by);
            const N enter = select(is_forward, t_lower, t_upper), leave = select(is_forward, t_upper, t_lower);
            const N enter_error = select(is_forward, t_lower_error, t_upper_error);
            const N leave_error = select(is_forward, t_upper_error, t_lower_error);
            near = select(is_crossed, larger(enter - enter_error, near), near);
            far = select(is_crossed, smaller(leave + leave_error, far), far);
            sure_near = select(is_crossed, larger(enter + enter_error, sure_near), sure_near);
            sure_far = select(is_crossed, smaller(leave - leave_error, sure_far), sure_far);

            hn::Store(at, d, start[i] + first);
            hn::Store(by, d, along[i] + first);
            hn::Store(over, d, inverse[i] + first);
            start_error[i] = at_error;
            along_error[i] = by_error;
            is_parallel[i] = hn::Not(is_crossed);
        }

        const N most = larger(absolute(near), absolute(far));
        auto is_outside = less(far, near);
        auto is_known = less(near, far);
        N error = zero, fastest = zero;
        for (std::size_t i = 0; i < 3; ++i) {
            const N at = hn::Load(d, start[i] + first), by = hn::Load(d, along[i] + first);
            const N own =
                start_error[i] + most * along_error[i] + number<N>(0x1p-51) * (absolute(at) + most * absolute(by));
            error = error + own;
            fastest = fastest + absolute(by) + along_error[i];
            const N size = number<N>(surface.volume().cell_shape()[static_cast<int>(i)]);
            const N one = at + near * by, other = at + far * by, bound = own * number<N>(1.0 + 0x1p-40);
            const N least = smaller(one, other) - bound, largest = larger(one, other) + bound;
            const auto is_beside = either(less(largest, zero), less(size, least));
            const auto is_within = both(less_equal(zero, least), less_equal(largest, size));
            is_outside = either(is_outside, both(is_parallel[i], is_beside));
            is_known = without(is_known, without(is_parallel[i], either(is_within, is_beside)));
        }
        error = error * number<N>(1.0 + 0x1p-40) + number<N>(0x1p-900);
        const N of_value = number<N>(placement.slope * (1.0 + 0x1p-20)) * error +
                           number<N>(placement.threshold_error + 0x1p-52 * std::abs(surface.threshold()));
        const auto is_finite = less(of_value + absolute(near) + absolute(far), number<N>(0x1p900));
        hn::Store(near, d, begin + first);
        hn::Store(far, d, end + first);
        hn::Store(sure_near, d, sure_begin + first);
        hn::Store(sure_far, d, sure_end + first);
        hn::Store(error, d, point_error + first);
        hn::Store(of_value, d, value_error + first);
        hn::Store(fastest * number<N>(1.0 + 0x1p-40), d, speed + first);
        is_outside = both(is_outside, is_finite);
        usable_ |= to_lane_mask(d, without(both(is_known, is_finite), is_outside), first);
        outside_ |= to_lane_mask(d, is_outside, first);
    }

    /// A bound on the error of a product t with `over`, one over a number that is at least 2^20 times its error.
    HWY_INLINE static N error_of_quotient(N t, N error, N over_error, N over)
    {
        return (error + absolute(t) * over_error) * absolute(over) * number<N>(1.0 + 0x1p-18) +
               number<N>(0x1p-50) * absolute(t);
    }

    LaneMask usable_ = 0, outside_ = 0;
};

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
