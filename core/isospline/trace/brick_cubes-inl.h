// Eight cubes that fill a cube of twice their edge, for tests against one or many rays. Included once for each target.
//
// A ray meets the planes of a cube at t = q + k |1 / d|, where q is the t of the plane through which it enters and k
// the distance from there in cells. So the eight cubes only differ in whether they are in the nearer or the farther
// half along each axis.
#if defined(ISOSPLINE_TRACE_BRICK_CUBES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_BRICK_CUBES_INL_H
#undef ISOSPLINE_TRACE_BRICK_CUBES_INL_H
#else
#define ISOSPLINE_TRACE_BRICK_CUBES_INL_H
#endif

#include "isospline/brick/block.h"
#include "isospline/cell/lane_mask-inl.h"

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Lanes are the eight children.
using Children = hn::CappedTag<float, 8>;

// Whether child i is in the upper half along each axis; then whether it is in the lower half.
alignas(32) constexpr float half_of_child[2][3][8] = {
    {{0, 1, 0, 1, 0, 1, 0, 1}, {0, 0, 1, 1, 0, 0, 1, 1}, {0, 0, 0, 0, 1, 1, 1, 1}},
    {{1, 0, 1, 0, 1, 0, 1, 0}, {1, 1, 0, 0, 1, 1, 0, 0}, {1, 1, 1, 1, 0, 0, 0, 0}}};

// The same set of children in the order in which a ray meets them: child i becomes bit i ^ flip. The bits of `flip` are
// the axes along which the ray's direction is negative.
HWY_INLINE unsigned front_to_back(unsigned children, unsigned flip)
{
    if (flip & 1u)
        children = (children & 0x55u) << 1 | (children >> 1 & 0x55u);
    if (flip & 2u)
        children = (children & 0x33u) << 2 | (children >> 2 & 0x33u);
    if (flip & 4u)
        children = (children & 0x0fu) << 4 | (children >> 4 & 0x0fu);
    return children;
}

// Lanes are the 16 blocks of a brick that have one z.
using Blocks16 = hn::CappedTag<float, 16>;

// x and y of these blocks; then counted from the other end.
alignas(64) constexpr float place_of_block[2][2][16] = {
    {{0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3}, {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3}},
    {{3, 2, 1, 0, 3, 2, 1, 0, 3, 2, 1, 0, 3, 2, 1, 0}, {3, 3, 3, 3, 2, 2, 2, 2, 1, 1, 1, 1, 0, 0, 0, 0}}};

// Mirrors the position of a block in its brick along the axes in `flip`.
HWY_INLINE unsigned flipped_block(unsigned block, unsigned flip)
{
    return block ^ ((flip & 1u) * 3u | (flip >> 1 & 1u) * 12u | (flip >> 2) * 48u);
}

// Like front_to_back(), for the blocks of a brick.
HWY_INLINE std::uint64_t blocks_front_to_back(std::uint64_t blocks, unsigned flip)
{
    if ((blocks & (blocks - 1u)) == 0)
        return blocks == 0 ? 0
                           : std::uint64_t{1} << flipped_block(
                                 static_cast<unsigned>(hwy::Num0BitsBelowLS1Bit_Nonzero64(blocks)), flip);
    const auto swap = [&](bool wanted, int distance, std::uint64_t lower) {
        const std::uint64_t swapped = (blocks & lower) << distance | (blocks >> distance & lower);
        blocks = wanted ? swapped : blocks;
    };
    swap((flip & 1u) != 0, 1, 0x5555555555555555u);
    swap((flip & 1u) != 0, 2, 0x3333333333333333u);
    swap((flip & 2u) != 0, 4, 0x0f0f0f0f0f0f0f0fu);
    swap((flip & 2u) != 0, 8, 0x00ff00ff00ff00ffu);
    swap((flip & 4u) != 0, 16, 0x0000ffff0000ffffu);
    swap((flip & 4u) != 0, 32, 0x00000000ffffffffu);
    return blocks;
}

// A margin in units of <normal, x>, from the margin along an axis: normals have three components of at most 31.
HWY_INLINE float slab_margin_of(float margin)
{
    return 96.0f * margin;
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
