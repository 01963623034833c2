// Conversions between SIMD masks and sets of lanes as bits. Included once for each target.
#if defined(ISOSPLINE_CELL_LANE_MASK_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_LANE_MASK_INL_H
#undef ISOSPLINE_CELL_LANE_MASK_INL_H
#else
#define ISOSPLINE_CELL_LANE_MASK_INL_H
#endif

#include "isospline/cell/lattice_ray_packet.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// The first of the vector's lanes is lane `first`.
template <class D>
HWY_INLINE LaneMask to_lane_mask(D d, hn::Mask<D> mask, std::size_t first)
{
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return static_cast<LaneMask>(bytes[0] | bytes[1] << 8) << first;
}

template <class D>
HWY_INLINE hn::Mask<D> to_mask(D d, LaneMask lanes, std::size_t first)
{
    const std::uint8_t bytes[8] = {static_cast<std::uint8_t>(lanes >> first),
                                   static_cast<std::uint8_t>(lanes >> first >> 8)};
    return hn::LoadMaskBits(d, bytes);
}

// Of lanes that are not none.
HWY_INLINE int lowest_lane(LaneMask lanes)
{
    return static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(lanes));
}

template <class D>
constexpr LaneMask all_lanes(D d)
{
    return (LaneMask{1} << hn::MaxLanes(d)) - 1u;
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
