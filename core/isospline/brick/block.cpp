#include "isospline/brick/block.h"

#include "isospline/brick/signs.h"
#include "isospline/spline/degree.h"

#include <array>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/brick/block.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/spline/cell_weights-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// The coefficients of a block of 2 x 2 x 2 cells, for SIMD lanes that work on different cells of it.

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

// Lanes are the cells of a block; a target with short vectors needs several.
using Cells = hn::CappedTag<float, Block::capacity>;

// Converts the B-spline coefficients of a cell to the Bernstein coefficients of the same polynomial; x is the last
// axis.
template <int Degree, class V>
HWY_INLINE void CellToBernstein(V (&c)[Degree + 1][Degree + 1][Degree + 1])
{
    const auto for_each_line = [](const auto& item) HWY_ATTR {
        for (int p = 0; p <= Degree; ++p)
            for (int q = 0; q <= Degree; ++q) {
                std::array<V, Degree + 1> line;
                for (int i = 0; i <= Degree; ++i)
                    line[i] = item(p, q, i);
                line = bernstein_of_bspline<Degree>(line);
                for (int i = 0; i <= Degree; ++i)
                    item(p, q, i) = line[i];
            }
    };
    for_each_line([&](int p, int q, int i) -> V& { return c[i][p][q]; });
    for_each_line([&](int p, int q, int i) -> V& { return c[p][i][q]; });
    for_each_line([&](int p, int q, int i) -> V& { return c[p][q][i]; });
}

// Sets slabs along the mean gradients of the cells.
//
// The Bernstein coefficients of a linear function l are its values at the Greville abscissae, which are 1/n apart. The
// coefficients of f - l are the differences of the coefficients. Bernstein polynomials are non-negative and sum to one,
// so f - l lies between the smallest and the largest difference. Where f is zero, l lies between their negatives.
template <int Degree>
void SetSlabs(Block& block, const CoefficientView& corner, double full_threshold, unsigned cells)
{
    // Positions of coefficients relative to the middle of the cell.
    constexpr int count = Degree + 1;
    constexpr auto position = [](int i) { return static_cast<float>(i) / Degree - 0.5f; };
    float squares_of_positions = 0.0f;
    for (int i = 0; i < count; ++i)
        squares_of_positions += position(i) * position(i) * static_cast<float>(count * count);

    const Cells d;
    const hn::RebindToSigned<Cells> to_int;
    const hn::Rebind<std::int8_t, Cells> to_byte;
    using V = hn::Vec<Cells>;
    const BlockTable<Degree> table(corner, cells);
    const auto single_threshold = static_cast<float>(full_threshold);
    const V threshold = hn::Set(d, single_threshold), zero = hn::Zero(d);
    const V limit = hn::Set(d, threshold_single(full_threshold));
    unsigned met = 0;
    for (std::size_t first = 0; first < Block::capacity; first += hn::Lanes(d)) {
        // The slope of the least-squares fit along each axis, except for a constant factor.
        const CoefficientsOfLanes<Degree, Cells> look_up(d, table, hn::Iota(to_int, static_cast<std::int32_t>(first)));
        V coefficients[count][count][count];
        V lowest = hn::Set(d, std::numeric_limits<float>::infinity()), highest = hn::Neg(lowest);
        V sums[3] = {zero, zero, zero};
        for (int k = 0; k < count; ++k)
            for (int j = 0; j < count; ++j)
                for (int i = 0; i < count; ++i) {
                    const V coefficient = look_up(i, j, k);
                    coefficients[k][j][i] = hn::Sub(coefficient, threshold);
                    lowest = hn::Min(lowest, coefficient);
                    highest = hn::Max(highest, coefficient);
                }
        const auto has_both_signs = hn::And(hn::Lt(lowest, limit), hn::Ge(highest, limit));
        const V magnitude = hn::Max(hn::Abs(hn::Sub(lowest, threshold)), hn::Abs(hn::Sub(highest, threshold)));
        CellToBernstein<Degree>(coefficients);
        for (int k = 0; k < count; ++k)
            for (int j = 0; j < count; ++j) {
                V sum = zero;
                for (int i = 0; i < count; ++i) {
                    const V coefficient = coefficients[k][j][i];
                    sum = hn::Add(sum, coefficient);
                    sums[0] = hn::MulAdd(hn::Set(d, position(i)), coefficient, sums[0]);
                }
                sums[1] = hn::MulAdd(hn::Set(d, position(j)), sum, sums[1]);
                sums[2] = hn::MulAdd(hn::Set(d, position(k)), sum, sums[2]);
            }
        const V largest = hn::Max(hn::Abs(sums[0]), hn::Max(hn::Abs(sums[1]), hn::Abs(sums[2])));
        const auto has_slope = hn::And(hn::Gt(largest, zero), hn::Le(largest, hn::Set(d, 1e37f)));

        // The linear function along the rounded normal.
        V normal[3], dot = zero, square = zero;
        const V longest = hn::Div(hn::Set(d, 31.0f), hn::IfThenElse(has_slope, largest, hn::Set(d, 1.0f)));
        for (int axis = 0; axis < 3; ++axis) {
            normal[axis] = hn::IfThenElseZero(has_slope, hn::Round(hn::Mul(sums[axis], longest)));
            dot = hn::MulAdd(normal[axis], sums[axis], dot);
            square = hn::MulAdd(normal[axis], normal[axis], square);
        }
        const V scale = hn::Div(dot, hn::Mul(square, hn::Set(d, squares_of_positions)));
        V least = hn::Set(d, std::numeric_limits<float>::infinity()), most = hn::Neg(least);
        for (int k = 0; k < count; ++k)
            for (int j = 0; j < count; ++j) {
                const V across = hn::Mul(
                    scale, hn::MulAdd(normal[1], hn::Set(d, position(j)), hn::Mul(normal[2], hn::Set(d, position(k)))));
                const V along = hn::Mul(scale, normal[0]);
                for (int i = 0; i < count; ++i) {
                    const V linear = hn::MulAdd(along, hn::Set(d, position(i)), across);
                    const V difference = hn::Sub(coefficients[k][j][i], linear);
                    least = hn::Min(least, difference);
                    most = hn::Max(most, difference);
                }
            }

        // Rounding errors: a Bernstein coefficient has at most 4 an axis, of numbers up to 3 times the magnitude. A
        // difference has 16 more, of numbers up to 5 times the magnitude. Both also have that of the threshold.
        const V rounding = hn::Mul(hn::Set(d, 0x1p-24f), hn::MulAdd(hn::Set(d, 116.0f), magnitude,
                                                                    hn::Set(d, 2.0f * std::abs(single_threshold))));
        const V middle = hn::Mul(hn::Set(d, 0.5f), hn::Add(normal[0], hn::Add(normal[1], normal[2])));
        const V of_the_quotient = hn::Set(d, 1e-4f), least_byte = hn::Set(d, -128.0f), most_byte = hn::Set(d, 127.0f);
        const V lower = hn::Sub(middle, hn::Div(hn::Add(most, rounding), scale));
        const V upper = hn::Sub(middle, hn::Div(hn::Sub(least, rounding), scale));
        const auto store = [&](V value, auto& bytes) HWY_ATTR {
            const V limited = hn::Max(least_byte, hn::Min(most_byte, value));
            hn::StoreU(hn::DemoteTo(to_byte, hn::ConvertTo(to_int, limited)), to_byte, bytes.data() + first);
        };
        for (int axis = 0; axis < 3; ++axis)
            store(normal[axis], block.slab_normal[axis]);
        const V slab_lower = hn::IfThenElse(has_slope, hn::Floor(hn::Sub(lower, of_the_quotient)), least_byte);
        const V slab_upper = hn::IfThenElse(has_slope, hn::Ceil(hn::Add(upper, of_the_quotient)), most_byte);
        store(slab_lower, block.slab_lower);
        store(slab_upper, block.slab_upper);

        // <normal, local> ranges from the sum of the negative components to the sum of the positive ones.
        V smallest = zero, greatest = zero;
        for (const V& component : normal) {
            smallest = hn::Add(smallest, hn::Min(component, zero));
            greatest = hn::Add(greatest, hn::Max(component, zero));
        }
        std::uint8_t bits[8] = {};
        const auto leaves_any = hn::And(hn::Le(slab_lower, greatest), hn::Ge(slab_upper, smallest));
        hn::StoreMaskBits(d, hn::And(has_both_signs, leaves_any), bits);
        met |= static_cast<unsigned>(bits[0]) << first;
    }
    block.cells = static_cast<std::uint8_t>(met & cells);
}

Block MakeBlock(const CoefficientView& first, int degree, double threshold, unsigned cells)
{
    Block block;
    dispatch_degree(degree, [&](auto n) { SetSlabs<n>(block, first, threshold, cells); });
    return block;
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(MakeBlock);

Block make_block(const CoefficientView& first, int degree, double threshold, unsigned cells)
{
    return HWY_DYNAMIC_DISPATCH(MakeBlock)(first, degree, threshold, cells);
}

} // namespace isospline
#endif
