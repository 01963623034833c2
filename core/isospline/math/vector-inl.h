// Vectors of three numbers, for one point or a point a SIMD lane. Included once for each SIMD target.
#include "isospline/math/number-inl.h"

#include <glm/vec3.hpp>

#include <array>

#if defined(ISOSPLINE_MATH_VECTOR_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_MATH_VECTOR_INL_H
#undef ISOSPLINE_MATH_VECTOR_INL_H
#else
#define ISOSPLINE_MATH_VECTOR_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

template <class N>
using Vector3 = std::array<N, 3>;

template <class N>
HWY_INLINE N dot(const Vector3<N>& a, const Vector3<N>& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class N>
HWY_INLINE Vector3<N> constant_vector(const glm::dvec3& vector)
{
    return {number<N>(vector.x), number<N>(vector.y), number<N>(vector.z)};
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
