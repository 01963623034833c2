#include "isospline/brick/block_ranges.h"

#include "isospline/spline/degree.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/brick/block_ranges.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/spline/cell_weights-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int blocks_along = brick_size / 2;

// Converts the coefficients of two neighbouring cells to those of the same spline with knots of full multiplicity at
// its ends, along one axis. The first are the Bernstein coefficients of the first cell, the last those of the second.
template <int Degree, class V>
HWY_INLINE std::array<V, Degree + 2> ClampEnds(const std::array<V, Degree + 2>& c)
{
    std::array<V, Degree + 1> first, second;
    for (int i = 0; i <= Degree; ++i) {
        first[i] = c[i];
        second[i] = c[i + 1];
    }
    first = bernstein_of_bspline<Degree>(first);
    second = bernstein_of_bspline<Degree>(second);
    std::array<V, Degree + 2> clamped = c; // the coefficient in the middle stays
    for (int i = 0; i <= Degree / 2; ++i) {
        clamped[i] = first[i];
        clamped[Degree + 1 - i] = second[Degree - i];
    }
    return clamped;
}

template <int Degree>
void SetRanges(BlockRanges& ranges, const CoefficientView& coefficients, const Brick& brick)
{
    // A row holds coefficient 0 of the four blocks along x, then coefficient 1, and so on.
    constexpr int side = Degree + 2, row_size = side * blocks_along, most = brick_size + Degree;
    const hn::CappedTag<float, row_size % 16 == 0 ? 16 : blocks_along> d;
    const hn::CappedTag<float, blocks_along> of_blocks;
    using V = hn::Vec<decltype(d)>;
    constexpr int lanes = static_cast<int>(hn::MaxLanes(d)), block_lanes = static_cast<int>(hn::MaxLanes(of_blocks));
    constexpr float infinity = std::numeric_limits<float>::infinity();

    // Clamp along x, then along y.
    alignas(64) float rows[most][row_size], slices[most][blocks_along][side][row_size];
    const glm::ivec3 size = brick.size + Degree;
    auto least = hn::Set(of_blocks, infinity), greatest = hn::Neg(least);
    for (int z = 0; z < size.z; ++z) {
        for (int y = 0; y < size.y; ++y) {
            const float* row = coefficients.from(0, y, z).first;
            float padded[brick_size + Degree];
            if (brick.size.x < brick_size) {
                std::fill(std::copy_n(row, size.x, padded), std::end(padded), row[size.x - 1]);
                row = padded;
            }
            alignas(64) float of_row[row_size];
            for (int i = 0; i < side; ++i)
                for (int block = 0; block < blocks_along; ++block)
                    of_row[i * blocks_along + block] = row[2 * block + i];
            for (int first = 0; first < blocks_along; first += block_lanes) {
                std::array<hn::Vec<decltype(of_blocks)>, side> along;
                for (int i = 0; i < side; ++i) {
                    along[i] = hn::Load(of_blocks, of_row + i * blocks_along + first);
                    least = hn::Min(least, along[i]);
                    greatest = hn::Max(greatest, along[i]);
                }
                along = ClampEnds<Degree>(along);
                for (int i = 0; i < side; ++i)
                    hn::Store(along[i], of_blocks, rows[y] + i * blocks_along + first);
            }
        }
        for (int block = 0; 2 * block < brick.size.y; ++block)
            for (int first = 0; first < row_size; first += lanes) {
                std::array<V, side> along;
                for (int i = 0; i < side; ++i)
                    along[i] = hn::Load(d, rows[std::min(2 * block + i, size.y - 1)] + first);
                along = ClampEnds<Degree>(along);
                for (int i = 0; i < side; ++i)
                    hn::Store(along[i], d, slices[z][block][i] + first);
            }
    }
    ranges.least = hn::GetLane(hn::MinOfLanes(of_blocks, least));
    ranges.most = hn::GetLane(hn::MaxOfLanes(of_blocks, greatest));

    // Clamp along z. A clamped coefficient has at most 6 roundings an axis, of numbers up to twice the magnitude.
    const float rounding = 0x1p-24f * 36.0f * std::max(std::abs(ranges.least), std::abs(ranges.most));
    ranges.lower.fill(infinity);
    ranges.upper.fill(-infinity);
    for (int block_z = 0; 2 * block_z < brick.size.z; ++block_z)
        for (int block_y = 0; 2 * block_y < brick.size.y; ++block_y) {
            float* const lower = ranges.lower.data() + blocks_along * (block_y + blocks_along * block_z);
            float* const upper = ranges.upper.data() + blocks_along * (block_y + blocks_along * block_z);
            for (int first = 0; first < row_size; first += lanes) {
                V lowest = hn::Set(d, infinity), highest = hn::Neg(lowest);
                for (int y = 0; y < side; ++y) {
                    std::array<V, side> along;
                    for (int i = 0; i < side; ++i)
                        along[i] = hn::Load(d, slices[std::min(2 * block_z + i, size.z - 1)][block_y][y] + first);
                    for (const V& each : ClampEnds<Degree>(along)) {
                        lowest = hn::Min(lowest, each);
                        highest = hn::Max(highest, each);
                    }
                }
                alignas(64) float of_lowest[lanes], of_highest[lanes];
                hn::Store(lowest, d, of_lowest);
                hn::Store(highest, d, of_highest);
                for (int i = 0; i < lanes; ++i) {
                    const int block = (first + i) % blocks_along;
                    if (2 * block >= brick.size.x)
                        continue;
                    lower[block] = std::min(lower[block], of_lowest[i] - rounding);
                    upper[block] = std::max(upper[block], of_highest[i] + rounding);
                }
            }
        }
}

BlockRanges FindBlockRanges(const CoefficientView& coefficients, const Brick& brick, int degree)
{
    BlockRanges ranges;
    dispatch_degree(degree, [&](auto n) { SetRanges<n>(ranges, coefficients, brick); });
    return ranges;
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(FindBlockRanges);

BlockRanges block_ranges(const CoefficientView& coefficients, const Brick& brick, int degree)
{
    return HWY_DYNAMIC_DISPATCH(FindBlockRanges)(coefficients, brick, degree);
}

} // namespace isospline
#endif
