// The coefficients of a block of 2 x 2 x 2 cells, for SIMD lanes that work on different cells of it. Included once for
// each target.
#if defined(ISOSPLINE_BRICK_BLOCK_TABLE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_BRICK_BLOCK_TABLE_INL_H
#undef ISOSPLINE_BRICK_BLOCK_TABLE_INL_H
#else
#define ISOSPLINE_BRICK_BLOCK_TABLE_INL_H
#endif

#include "isospline/spline/coefficient_view.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A copy of the coefficients of all wanted cells. Neighbouring cells share most of their coefficients, so the table is
// hardly larger than the coefficients of one cell.
template <int Degree>
struct BlockTable {
    static constexpr int vector_row = 4; // floats that may be read from the beginning of a row
    static constexpr int side = Degree + 2;
    static constexpr int row = Degree <= 2 ? 4 : 8;
    static constexpr int plane = side * row;

    // `corner` is the first cell, which need not be wanted; bit i of `wanted` is cell i. Only the coefficients of
    // wanted cells have to be in memory.
    BlockTable(const CoefficientView& corner, unsigned wanted)
    {
        const hn::CappedTag<float, vector_row> d;
        constexpr int lanes = static_cast<int>(hn::MaxLanes(d));
        const auto any_second_along = [&](unsigned axis) {
            constexpr unsigned seconds[3] = {0xaau, 0xccu, 0xf0u};
            return (wanted & seconds[axis]) != 0;
        };
        for (int k = 0; k <= Degree + any_second_along(2); ++k)
            for (int j = 0; j <= Degree + any_second_along(1); ++j) {
                const float* from = corner.first + j * corner.row_stride + k * corner.slice_stride;
                float* to = coefficients + k * plane + j * row;
                for (int i = 0; i < vector_row; i += lanes)
                    hn::Store(hn::LoadU(d, from + i), d, to + i);
                if (vector_row < side && any_second_along(0))
                    to[vector_row] = from[vector_row];
            }
    }

    // A vector may be loaded from the beginning of each row.
    alignas(64) float coefficients[side * plane + 16] = {};
};

// Looks up coefficients of a block; each lane has its own cell.
template <int Degree, class D>
class CoefficientsOfLanes {
    using Table = BlockTable<Degree>;
    using ToInt = hn::RebindToSigned<D>;
    using V = hn::Vec<D>;
    // One vector holds all rows of one plane that lanes may need.
    static constexpr bool rows_in_vector = 2 * Table::row <= static_cast<int>(hn::MaxLanes(D()));

public:
    HWY_INLINE CoefficientsOfLanes(D d, const Table& table, hn::Vec<ToInt> cell)
        : table_(table.coefficients), is_upper_(hn::RebindMask(d, hn::Gt(cell, hn::Set(ToInt(), 3)))),
          first_(hn::Add(bit<0>(cell), hn::Mul(bit<1>(cell), hn::Set(ToInt(), std::int32_t{Table::row}))))
    {
        if constexpr (!rows_in_vector)
            first_ = hn::Add(first_, hn::Mul(bit<2>(cell), hn::Set(ToInt(), std::int32_t{Table::plane})));
    }

    // The coefficients (i, j, k) of the lanes' cells.
    HWY_INLINE V operator()(int i, int j, int k) const
    {
        const D d;
        const float* lower = table_ + k * Table::plane + j * Table::row;
        if constexpr (rows_in_vector) {
            const auto index = hn::IndicesFromVec(d, hn::Add(first_, hn::Set(ToInt(), i)));
            return hn::IfThenElse(is_upper_, hn::TableLookupLanes(hn::LoadU(d, lower + Table::plane), index),
                                  hn::TableLookupLanes(hn::LoadU(d, lower), index));
        } else {
            return hn::GatherIndex(d, lower + i, first_);
        }
    }

private:
    template <int Axis>
    static HWY_INLINE hn::Vec<ToInt> bit(hn::Vec<ToInt> cell)
    {
        return hn::And(hn::ShiftRight<Axis>(cell), hn::Set(ToInt(), 1));
    }

    const float* table_;
    hn::Mask<D> is_upper_;
    hn::Vec<ToInt> first_; // of the lane's cell: in its plane, or in the table if lanes gather
};

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
