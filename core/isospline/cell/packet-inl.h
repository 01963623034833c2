// The first roots of a packet of rays, each in its own cell; SIMD lanes are the rays.
// Included once for each target.
#include "isospline/cell/candidate_cells.h"
#include "isospline/cell/lane_mask-inl.h"
#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/cell/single_ray-inl.h"

#if defined(ISOSPLINE_CELL_PACKET_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_PACKET_INL_H
#undef ISOSPLINE_CELL_PACKET_INL_H
#else
#define ISOSPLINE_CELL_PACKET_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

using Singles = hn::CappedTag<float, LatticeRayPacket::capacity>;
using Doubles = hn::CappedTag<double, LatticeRayPacket::capacity>;

// So few rays or fewer are faster one after the other.
constexpr int few_lanes = 2;

// scaled_bernstein() of the rays.
using ScaledPacket = const float (*)[LatticeRayPacket::capacity];

// The coefficients of the cells of some lanes less the threshold.
template <int Degree, class V>
class CoefficientsOfLanes {
public:
    HWY_INLINE CoefficientsOfLanes(const CandidateCells& cells, double threshold, std::size_t first)
        : threshold_(threshold)
    {
        const hn::DFromV<V> d;
        const hn::Rebind<float, decltype(d)> singles;
        const V reduction = hn::Set(d, static_cast<hn::TFromV<V>>(threshold));
        for (std::size_t i = 0; i < count; ++i) {
            if constexpr (std::is_same_v<hn::TFromV<V>, float>)
                hn::Store(hn::Sub(hn::Load(d, cells.coefficients[i] + first), reduction), d, values_[i]);
            else
                hn::Store(hn::Sub(hn::PromoteTo(d, hn::Load(singles, cells.coefficients[i] + first)), reduction), d,
                          values_[i]);
        }
    }

    HWY_INLINE V operator()(std::size_t i, std::size_t j, std::size_t k) const
    {
        return hn::Load(hn::DFromV<V>(), values_[(k * (Degree + 1) + j) * (Degree + 1) + i]);
    }

    /// rounding_error_of_bernstein() of single precision.
    HWY_INLINE V error() const
    {
        const hn::DFromV<V> d;
        V magnitude = hn::Zero(d);
        for (const auto& value : values_)
            magnitude = hn::Max(magnitude, hn::Abs(hn::Load(d, value)));
        return rounding_error_of_bernstein<Degree>(magnitude, threshold_);
    }

private:
    static constexpr std::size_t count = (Degree + 1) * (Degree + 1) * (Degree + 1);

    double threshold_;
    alignas(64) hn::TFromV<V> values_[count][hn::MaxLanes(hn::DFromV<V>())];
};

// One cell of all rays.
template <int Degree>
class OneCell {
public:
    HWY_INLINE OneCell(const CandidateCells& cells, double threshold)
        : cell_(cells.only, threshold, cells.lower_of_only)
    {
    }

    HWY_INLINE std::array<hn::Vec<Doubles>, 3> lower(std::size_t) const
    {
        const Doubles d;
        return {hn::Set(d, cell_.lower.x), hn::Set(d, cell_.lower.y), hn::Set(d, cell_.lower.z)};
    }
    template <typename Real>
    HWY_INLINE ReducedCoefficients<Degree, Real> coefficients(std::size_t) const
    {
        return ReducedCoefficients<Degree, Real>(cell_);
    }
    HWY_INLINE const CellCoefficients& of_lane(int) const { return cell_; }

private:
    CellCoefficients cell_;
};

// The copied cells of several rays.
template <int Degree>
class CellsOfLanes {
public:
    HWY_INLINE CellsOfLanes(const CandidateCells& cells, double threshold) : cells_(cells), threshold_(threshold) {}

    HWY_INLINE std::array<hn::Vec<Doubles>, 3> lower(std::size_t first) const
    {
        const Doubles d;
        const hn::Rebind<std::int32_t, Doubles> to_int;
        const auto corner = [&](int axis)
                                HWY_ATTR { return hn::PromoteTo(d, hn::Load(to_int, cells_.lower[axis] + first)); };
        return {corner(0), corner(1), corner(2)};
    }
    template <typename Real>
    HWY_INLINE auto coefficients(std::size_t first) const
    {
        return CoefficientsOfLanes<Degree, hn::Vec<hn::CappedTag<Real, LatticeRayPacket::capacity>>>(cells_, threshold_,
                                                                                                     first);
    }
    HWY_INLINE CellOfLane<Degree> of_lane(int lane) const { return {cells_, threshold_, lane}; }

private:
    const CandidateCells& cells_;
    double threshold_;
};

// Where the rays of a packet are inside their cells.
struct PacketSegments {
    alignas(64) double t_near[LatticeRayPacket::capacity];
    alignas(64) double t_far[LatticeRayPacket::capacity];
    alignas(64) float entry[3][LatticeRayPacket::capacity]; ///< local coordinates
    alignas(64) float exit[3][LatticeRayPacket::capacity];
};

// The segments of the rays that belong to their cells. Returns the lanes whose segment exists and is, at least in part,
// within the part of the ray that cuts leave, and before t_limit.
template <class Cells>
HWY_INLINE LaneMask clip_packet(const Cells& cells, const LatticeRayPacket& rays, const double* HWY_RESTRICT t_limit,
                                LaneMask active, PacketSegments& segments)
{
    const Doubles d;
    using V = hn::Vec<Doubles>;
    const hn::Rebind<float, Doubles> to_float;
    LaneMask inside = 0;
    for (std::size_t first = 0; first < LatticeRayPacket::capacity; first += hn::Lanes(d)) {
        if ((active >> first & all_lanes(d)) == 0)
            continue;
        const auto lower = cells.lower(first);
        V origin[3], direction[3];
        V t_near = hn::Set(d, -huge_inverse), t_far = hn::Set(d, huge_inverse);
        for (int axis = 0; axis < 3; ++axis) {
            origin[axis] = hn::Load(d, rays.origin[axis] + first);
            direction[axis] = hn::Load(d, rays.direction[axis] + first);
            const V inverse = hn::Load(d, rays.inverse_direction[axis] + first);
            const V plane_origin = hn::Load(d, rays.plane_origin[axis] + first);
            const V upper = hn::Add(lower[axis], hn::Set(d, 1.0));
            const V to_lower = hn::Mul(hn::Sub(lower[axis], plane_origin), inverse);
            const V to_upper = hn::Mul(hn::Sub(upper, plane_origin), inverse);
            t_near = hn::Max(t_near, hn::Min(to_lower, to_upper));
            t_far = hn::Min(t_far, hn::Max(to_lower, to_upper));
        }
        const V end = hn::Min(hn::Load(d, rays.t_far + first), hn::Load(d, t_limit + first));
        const auto in_reach = hn::And(hn::Le(t_near, end), hn::Ge(t_far, hn::Load(d, rays.t_near + first)));
        inside |= to_lane_mask(d, hn::And(hn::Lt(t_near, t_far), in_reach), first);
        hn::Store(t_near, d, segments.t_near + first);
        hn::Store(t_far, d, segments.t_far + first);
        for (int axis = 0; axis < 3; ++axis) {
            const auto local = [&](V t) HWY_ATTR {
                return hn::DemoteTo(to_float, hn::Sub(hn::Add(origin[axis], hn::Mul(t, direction[axis])), lower[axis]));
            };
            hn::Store(local(t_near), to_float, segments.entry[axis] + first);
            hn::Store(local(t_far), to_float, segments.exit[axis] + first);
        }
    }
    return inside & active;
}

// What single precision proves about the segments.
template <int Degree>
struct PacketVerdict {
    LaneMask one_root = 0, undecided = 0;
    LaneMask rising = 0; ///< of those with one root: f increases along the ray
    alignas(64) float scaled[3 * Degree + 1][LatticeRayPacket::capacity]; ///< of those with one root
};

template <int Degree, class Cells>
HWY_INLINE PacketVerdict<Degree> judge_packet(const Cells& cells, const PacketSegments& segments, LaneMask inside)
{
    const Singles d;
    using V = hn::Vec<Singles>;
    constexpr int order = 3 * Degree;
    PacketVerdict<Degree> verdict;
    for (std::size_t first = 0; first < LatticeRayPacket::capacity; first += hn::Lanes(d)) {
        const LaneMask wanted = inside & all_lanes(d) << first;
        if (wanted == 0)
            continue;
        const auto coefficients = cells.template coefficients<float>(first);
        const auto load = [&](const auto& axes) HWY_ATTR {
            return std::array<V, 3>{hn::Load(d, axes[0] + first), hn::Load(d, axes[1] + first),
                                    hn::Load(d, axes[2] + first)};
        };
        const auto scaled = scaled_bernstein<Degree>(coefficients, load(segments.entry), load(segments.exit));
        const Verdict<V> proven = judge<order>(scaled, in_lanes<V>(coefficients.error()));
        const LaneMask one_root = to_lane_mask(d, proven.one_root, first) & wanted;
        verdict.one_root |= one_root;
        verdict.undecided |= wanted & ~to_lane_mask(d, proven.no_root, first) & ~one_root;
        if (one_root != 0) {
            verdict.rising |= to_lane_mask(d, hn::Lt(scaled[0], hn::Zero(d)), first) & one_root;
            for (int r = 0; r <= order; ++r)
                hn::Store(scaled[r], d, verdict.scaled[r] + first);
        }
    }
    return verdict;
}

// Whether crossings at t count, one ray per lane.
HWY_INLINE hn::Mask<Doubles> are_within_limits(const LatticeRayPacket& rays, std::size_t first, hn::Vec<Doubles> t)
{
    const Doubles d;
    const auto load = [&](const double* values) HWY_ATTR { return hn::Load(d, values + first); };
    const auto given = hn::Add(load(rays.limits.shift), hn::Div(t, load(rays.limits.length)));
    return hn::And(hn::And(hn::Ge(t, load(rays.t_near)), hn::Le(t, load(rays.t_far))),
                   hn::And(hn::Ge(given, load(rays.limits.t_near)), hn::Le(given, load(rays.limits.t_far))));
}

// The approximate roots of lanes that have one root.
template <int Degree>
struct PacketEstimate {
    HWY_INLINE PacketEstimate(ScaledPacket scaled, LaneMask lanes)
    {
        const Singles d;
        for (std::size_t first = 0; first < LatticeRayPacket::capacity; first += hn::Lanes(d)) {
            if ((lanes >> first & all_lanes(d)) == 0)
                continue;
            Bernstein<3 * Degree, hn::Vec<Singles>> polynomial;
            for (int r = 0; r <= 3 * Degree; ++r)
                polynomial[r] = hn::Load(d, scaled[r] + first);
            const auto estimate = estimate_root<3 * Degree>(polynomial);
            hn::Store(estimate.s, d, s + first);
            hn::Store(estimate.slope, d, slope + first);
        }
    }

    alignas(64) float s[LatticeRayPacket::capacity];
    alignas(64) float slope[LatticeRayPacket::capacity];
};

// The roots that double precision finds from those of single precision.
struct RefinedRoots {
    LaneMask found = 0;     ///< that count
    LaneMask undecided = 0; ///< where double precision does not converge
};

template <int Degree, class Cells>
HWY_INLINE RefinedRoots refine_packet(const Cells& cells, const LatticeRayPacket& rays, const PacketSegments& segments,
                                      ScaledPacket scaled, LaneMask lanes, const double* HWY_RESTRICT t_limit,
                                      RootPacket& roots)
{
    RefinedRoots refined;
    if (lanes == 0)
        return refined;
    const PacketEstimate<Degree> estimate(scaled, lanes);
    const Doubles d;
    const hn::Rebind<float, Doubles> to_float;
    for (std::size_t first = 0; first < LatticeRayPacket::capacity; first += hn::Lanes(d)) {
        const LaneMask wanted = lanes & all_lanes(d) << first;
        if (wanted == 0)
            continue;
        const auto coefficients = cells.template coefficients<double>(first);
        RootSearch<hn::Vec<Doubles>> search;
        for (int axis = 0; axis < 3; ++axis) {
            search.origin[axis] = hn::Load(d, rays.origin[axis] + first);
            search.direction[axis] = hn::Load(d, rays.direction[axis] + first);
        }
        search.begin(hn::Load(d, segments.t_near + first), hn::Load(d, segments.t_far + first),
                     {hn::PromoteTo(d, hn::Load(to_float, estimate.s + first)),
                      hn::PromoteTo(d, hn::Load(to_float, estimate.slope + first))});
        const PointsOfCell<Degree, std::remove_cvref_t<decltype(coefficients)>> cell{coefficients};
        const auto arrived = refine_root(cell, cells.lower(first), to_mask(d, wanted, first), search);
        const auto near_enough = hn::Le(search.t, hn::Load(d, t_limit + first));
        const auto counts = hn::And(hn::And(arrived, near_enough), are_within_limits(rays, first, search.t));
        hn::Store(search.t, d, roots.t + first);
        for (int axis = 0; axis < 3; ++axis)
            hn::Store(search.gradient[axis], d, roots.gradient[axis] + first);
        refined.found |= to_lane_mask(d, counts, first);
        refined.undecided |= wanted & ~to_lane_mask(d, arrived, first);
    }
    return refined;
}

template <int Degree, class Cells>
LaneMask first_roots_in(const Cells& cells, const LatticeRayPacket& rays, const double* HWY_RESTRICT t_limit,
                        LaneMask active, RootPacket& roots)
{
    PacketSegments segments;
    const LaneMask inside = clip_packet(cells, rays, t_limit, active, segments);
    if (inside == 0)
        return 0;

    LaneMask found = 0, others = inside;
    if (std::popcount(inside) > few_lanes) {
        const PacketVerdict<Degree> verdict = judge_packet<Degree>(cells, segments, inside);
        const RefinedRoots refined =
            refine_packet<Degree>(cells, rays, segments, verdict.scaled, verdict.one_root, t_limit, roots);
        found = refined.found;
        others = verdict.undecided | refined.undecided;
    }

    // The other segments, one by one.
    for (LaneMask rest = others; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const auto& cell = cells.of_lane(lane);
        const auto root =
            first_root_in_segment<Degree>(cell, rays.ray(lane), Interval{segments.t_near[lane], segments.t_far[lane]});
        if (!root || root->t > t_limit[lane])
            continue;
        found |= LaneMask{1} << lane;
        roots.set(lane, *root);
    }
    return found;
}

// Calls `body` with the cells of a packet.
template <int Degree, typename Body>
HWY_INLINE auto with_cells(const CandidateCells& cells, double threshold, const Body& body)
{
    return cells.are_copied ? body(CellsOfLanes<Degree>(cells, threshold)) : body(OneCell<Degree>(cells, threshold));
}

template <int Degree>
LaneMask exact_first_roots(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays,
                           const double* t_limit, RootPacket& roots)
{
    return with_cells<Degree>(cells, threshold, [&](const auto& of_lanes) HWY_ATTR {
        return first_roots_in<Degree>(of_lanes, rays, t_limit, cells.lanes, roots);
    });
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
