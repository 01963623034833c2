// Collects the cells of one block that lanes of a packet may cross the surface in. Included once for each target.
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

class PacketCandidates {
public:
    PacketCandidates(int degree, const PacketVisitor& visitor) : degree_(degree), visitor_(visitor) {}

    // Adds a cell. If a lane has one already, the visitor gets the cells so far. Returns whether t_limit is lower now.
    HWY_INLINE bool add(const CoefficientView& coefficients, const glm::ivec3& cell, LaneMask lanes)
    {
        const bool lowered = (cells_.lanes & lanes) != 0 && finish();
        add_candidate(coefficients, degree_, cell, lanes, cells_);
        return lowered;
    }

    // Passes the cells to the visitor. Returns whether t_limit is lower now.
    HWY_INLINE bool finish()
    {
        if (cells_.lanes == 0)
            return false;
        const bool lowered = visitor_.visit(visitor_.context, cells_);
        cells_.lanes = 0;
        return lowered;
    }

private:
    int degree_;
    const PacketVisitor& visitor_;
    CandidateCells cells_;
};

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
