// Directions to lights, for one point or for one point per SIMD lane. Included once for each SIMD target.
#include "isospline/math/vector-inl.h"
#include "isospline/shade/light.h"

#include <cstddef>

#if defined(ISOSPLINE_SHADE_LIGHT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_SHADE_LIGHT_INL_H
#undef ISOSPLINE_SHADE_LIGHT_INL_H
#else
#define ISOSPLINE_SHADE_LIGHT_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// The unit vector from a point to a light; zero for a light at the point itself, which gives no light.
template <class N>
HWY_INLINE Vector3<N> to_light(const PositionalLight& light, const Vector3<N>& position)
{
    Vector3<N> offset = constant_vector<N>(light.position);
    for (std::size_t axis = 0; axis < 3; ++axis)
        offset[axis] = offset[axis] - position[axis];
    const N distance = square_root(dot(offset, offset));
    const auto is_apart = less(number<N>(0.0), distance);
    for (N& coordinate : offset)
        coordinate = select(is_apart, coordinate / distance, number<N>(0.0));
    return offset;
}

template <class N>
HWY_INLINE Vector3<N> to_light(const DirectionalLight& light, const Vector3<N>&)
{
    return constant_vector<N>(light.to_light);
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
