// Collects the cells that lanes of a packet may cross the surface in. Included once for each target.
#include "isospline/cell/candidate_cells-inl.h"
#include "isospline/trace/brick_trace.h"

#if defined(ISOSPLINE_TRACE_PACKET_CANDIDATES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_PACKET_CANDIDATES_INL_H
#undef ISOSPLINE_TRACE_PACKET_CANDIDATES_INL_H
#else
#define ISOSPLINE_TRACE_PACKET_CANDIDATES_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

// The lanes of `first` that begin in a cell.
HWY_INLINE LaneMask lanes_beginning_in(const FirstCells& first, const glm::ivec3& cell)
{
    const hn::CappedTag<std::int32_t, packet_capacity> d;
    LaneMask lanes = 0;
    for (std::size_t lane = 0; lane < packet_capacity; lane += hn::Lanes(d)) {
        const auto same = [&](int axis) HWY_ATTR {
            return hn::Eq(hn::Load(d, first.lower[axis] + lane), hn::Set(d, cell[axis]));
        };
        lanes |= to_lane_mask(d, hn::And(hn::And(same(0), same(1)), same(2)), lane);
    }
    return lanes & first.lanes;
}

class PacketCandidates {
public:
    PacketCandidates(int degree, const PacketVisitor& visitor)
        : degree_(degree), visitor_(visitor), cells_(visitor.waiting != nullptr ? *visitor.waiting : own_)
    {
    }

    // Adds a cell. If a lane has one already, the visitor gets the cells so far. Returns whether t_limit is lower now.
    HWY_INLINE bool add(const CoefficientView& coefficients, const glm::ivec3& cell, LaneMask lanes)
    {
        if (visitor_.decided != nullptr)
            lanes &= ~lanes_beginning_in(*visitor_.decided, cell);
        if (lanes == 0)
            return false;
        const bool lowered = (cells_.lanes & lanes) != 0 && pass();
        add_candidate(coefficients, degree_, cell, lanes, cells_);
        return lowered;
    }

    // Passes the cells to the visitor, unless they may wait for those of other blocks. Returns whether t_limit is lower
    // now.
    HWY_INLINE bool finish() { return visitor_.waiting == nullptr && cells_.lanes != 0 && pass(); }

private:
    HWY_INLINE bool pass()
    {
        const bool lowered = visitor_.visit(visitor_.context, cells_);
        cells_.lanes = 0;
        return lowered;
    }

    int degree_;
    const PacketVisitor& visitor_;
    CandidateCells own_;
    CandidateCells& cells_;
};

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
