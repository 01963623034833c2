// Adds candidate cells of a packet; SIMD lanes are the rays. Included once for each target.
#include "isospline/cell/candidate_cells.h"
#include "isospline/cell/lane_mask-inl.h"

#if defined(ISOSPLINE_CELL_CANDIDATE_CELLS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_CANDIDATE_CELLS_INL_H
#undef ISOSPLINE_CELL_CANDIDATE_CELLS_INL_H
#else
#define ISOSPLINE_CELL_CANDIDATE_CELLS_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

// Sets some of the lanes. Processors of AMD with AVX2 take 12 cycles or more for a masked store.
template <class D, class V, class M>
HWY_INLINE void set_lanes(D d, V value, M mask, hn::TFromD<D>* to)
{
    hn::Store(hn::IfThenElse(mask, value, hn::Load(d, to)), d, to);
}

template <int Degree>
HWY_INLINE void copy_to_lane(const CoefficientView& cell, const glm::ivec3& lower, int lane, CandidateCells& cells)
{
    for (int axis = 0; axis < 3; ++axis)
        cells.lower[axis][lane] = lower[axis];
    auto* to = cells.coefficients;
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j) {
            const float* const row = cell.first + j * cell.row_stride + k * cell.slice_stride;
            for (int i = 0; i <= Degree; ++i)
                (*to++)[lane] = row[i];
        }
}

template <int Degree>
HWY_INLINE void copy_to_lanes_of_degree(const CoefficientView& cell, const glm::ivec3& lower, LaneMask lanes,
                                        CandidateCells& cells)
{
    const hn::CappedTag<float, CandidateCells::capacity> d;
    const hn::RebindToSigned<decltype(d)> to_int;
    for (std::size_t first = 0; first < CandidateCells::capacity; first += hn::Lanes(d)) {
        if ((lanes >> first & all_lanes(d)) == 0)
            continue;
        const auto mask = to_mask(d, lanes, first);
        for (int axis = 0; axis < 3; ++axis)
            set_lanes(to_int, hn::Set(to_int, lower[axis]), hn::RebindMask(to_int, mask), cells.lower[axis] + first);
        auto* to = cells.coefficients;
        for (int k = 0; k <= Degree; ++k)
            for (int j = 0; j <= Degree; ++j) {
                const float* const row = cell.first + j * cell.row_stride + k * cell.slice_stride;
                for (int i = 0; i <= Degree; ++i)
                    set_lanes(d, hn::Set(d, row[i]), mask, *to++ + first);
            }
    }
}

HWY_INLINE void copy_to_lanes(const CoefficientView& cell, int degree, const glm::ivec3& lower, LaneMask lanes,
                              CandidateCells& cells)
{
    switch (degree) {
    case 1:
        return copy_to_lanes_of_degree<1>(cell, lower, lanes, cells);
    case 2:
        return copy_to_lanes_of_degree<2>(cell, lower, lanes, cells);
    default:
        return copy_to_lanes_of_degree<3>(cell, lower, lanes, cells);
    }
}

inline HWY_NOINLINE void add_another(const CoefficientView& cell, int degree, const glm::ivec3& lower, LaneMask added,
                                     CandidateCells& cells)
{
    if (!cells.are_copied)
        copy_to_lanes(cells.only, degree, cells.lower_of_only, cells.lanes, cells);
    cells.are_copied = true;
    copy_to_lanes(cell, degree, lower, added, cells);
    cells.lanes |= added;
}

// Sets the cell of lanes that have none yet.
HWY_INLINE void add_candidate(const CoefficientView& cell, int degree, const glm::ivec3& lower, LaneMask added,
                              CandidateCells& cells)
{
    if (cells.lanes != 0)
        return add_another(cell, degree, lower, added, cells);
    cells.are_copied = false;
    cells.only = cell;
    cells.lower_of_only = lower;
    cells.lanes = added;
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
