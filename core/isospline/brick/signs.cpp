#include "isospline/brick/signs.h"

#include <hwy/highway.h>

#include <algorithm>

namespace isospline {

namespace hn = hwy::HWY_NAMESPACE;

namespace {

/// A brick has at most 8 + 3 rows of coefficients along an axis.
constexpr std::size_t most_rows = brick_size + 3;

/// Bit i is set if row[i] < threshold, for `count` coefficients; higher bits have no meaning. If `count` is not a
/// multiple of four, the last four are read again.
unsigned below(const float* row, int count, float threshold)
{
    const hn::CappedTag<float, 4> d;
    constexpr int lanes = static_cast<int>(hn::MaxLanes(d));
    unsigned bits = 0;
    for (int i = 0; i < count; i += lanes) {
        const int first = std::max(std::min(i, count - lanes), 0);
        std::uint8_t mask[8];
        hn::StoreMaskBits(d, hn::Lt(hn::LoadU(d, row + first), hn::Set(d, threshold)), mask);
        bits |= static_cast<unsigned>(mask[0]) << first;
    }
    return bits;
}

/// For the cells of one slice of coefficients: whether any and whether all of their (n+1)^2 are below the threshold.
struct Slice {
    std::uint64_t any, all;
};

Slice slice_signs(const float* first_row, std::ptrdiff_t row_stride, const Brick& brick, int degree, float threshold)
{
    // Along x: cell x reads the coefficients x ... x + n. Rows are bytes, the last three of eleven in a second word.
    std::uint64_t any[2] = {0, 0}, all[2] = {0, 0};
    for (int y = 0; y < brick.size.y + degree; ++y) {
        const unsigned bits = below(first_row + y * row_stride, brick.size.x + degree, threshold);
        unsigned any_of_row = bits, all_of_row = bits;
        for (int shift = 1; shift <= degree; ++shift) {
            any_of_row |= bits >> shift;
            all_of_row &= bits >> shift;
        }
        any[y / brick_size] |= std::uint64_t{any_of_row & 0xffu} << brick_size * (y % brick_size);
        all[y / brick_size] |= std::uint64_t{all_of_row & 0xffu} << brick_size * (y % brick_size);
    }

    // Along y.
    Slice slice{any[0], all[0]};
    for (int rows = 1; rows <= degree; ++rows) {
        slice.any |= any[0] >> brick_size * rows | any[1] << (64 - brick_size * rows);
        slice.all &= all[0] >> brick_size * rows | all[1] << (64 - brick_size * rows);
    }
    return slice;
}

} // namespace

BrickCells mixed_cells(const CoefficientView& coefficients, const Brick& brick, int degree, double threshold)
{
    const float limit = threshold_single(threshold);

    std::array<Slice, most_rows> slices;
    for (int z = 0; z < brick.size.z + degree; ++z)
        slices[static_cast<std::size_t>(z)] = slice_signs(coefficients.first + z * coefficients.slice_stride,
                                                          coefficients.row_stride, brick, degree, limit);

    // Along z. A brick that is less than eight cells wide or high leaves bits that are not cells.
    BrickCells cells = all_cells(brick.size);
    for (int z = 0; z < brick.size.z; ++z) {
        std::uint64_t any = 0, all = ~std::uint64_t(0);
        for (int k = z; k <= z + degree; ++k) {
            any |= slices[static_cast<std::size_t>(k)].any;
            all &= slices[static_cast<std::size_t>(k)].all;
        }
        cells[static_cast<std::size_t>(z)] &= any & ~all;
    }
    return cells;
}

} // namespace isospline
