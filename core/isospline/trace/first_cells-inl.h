// The cells in which the rays of a packet begin. Included once for each target.
#include "isospline/cell/candidate_cells-inl.h"
#include "isospline/trace/brick_trace.h"
#include "isospline/trace/packet_candidates-inl.h"

#if defined(ISOSPLINE_TRACE_FIRST_CELLS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_FIRST_CELLS_INL_H
#undef ISOSPLINE_TRACE_FIRST_CELLS_INL_H
#else
#define ISOSPLINE_TRACE_FIRST_CELLS_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

inline void add_first_cells(const Volume& volume, const LatticeRayPacket& rays, LaneMask lanes, FirstCells& first,
                            CandidateCells& cells)
{
    const hn::CappedTag<double, packet_capacity> d;
    const hn::Rebind<std::int32_t, decltype(d)> to_int;
    const glm::ivec3 shape = volume.cell_shape();
    first.lanes = 0;
    for (std::size_t lane = 0; lane < packet_capacity; lane += hn::Lanes(d)) {
        const auto t = hn::Load(d, rays.t_near + lane);
        auto inside = hn::FirstN(d, hn::Lanes(d));
        for (int axis = 0; axis < 3; ++axis) {
            const auto begin =
                hn::MulAdd(t, hn::Load(d, rays.direction[axis] + lane), hn::Load(d, rays.origin[axis] + lane));
            const auto lower = hn::Floor(begin);
            const auto size = hn::Set(d, static_cast<double>(shape[axis]));
            inside = hn::And(inside, hn::And(hn::Ge(lower, hn::Zero(d)), hn::Lt(lower, size)));
            const auto limited = hn::Min(hn::Max(lower, hn::Zero(d)), size);
            hn::Store(hn::DemoteTo(to_int, limited), to_int, first.lower[axis] + lane);
        }
        first.lanes |= to_lane_mask(d, inside, lane);
    }
    first.lanes &= lanes;
    cells.lanes = 0;
    for (LaneMask rest = first.lanes; rest != 0;) {
        const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(rest);
        const glm::ivec3 cell(first.lower[0][lane], first.lower[1][lane], first.lower[2][lane]);
        const LaneMask of_cell = lanes_beginning_in(first, cell);
        add_candidate(volume.cell(cell, nullptr), volume.degree(), cell, of_cell, cells);
        rest &= ~of_cell;
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
