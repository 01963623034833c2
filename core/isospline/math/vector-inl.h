// Vectors of three numbers, for one point or for one point per SIMD lane. Included once for each SIMD target.
#include "isospline/math/number-inl.h"

#include <glm/mat4x4.hpp>
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

/// The image of a point, for w = 1, or of a vector, for w = 0, under an affine map: GLM's product, in the same order.
template <class N>
HWY_INLINE Vector3<N> transformed(const glm::dmat4& map, const Vector3<N>& vector, double w)
{
    const auto coordinate = [&](int row) HWY_ATTR {
        const Vector3<N> of_row = {number<N>(map[0][row]), number<N>(map[1][row]), number<N>(map[2][row])};
        return (of_row[0] * vector[0] + of_row[1] * vector[1]) + (of_row[2] * vector[2] + number<N>(map[3][row] * w));
    };
    return {coordinate(0), coordinate(1), coordinate(2)};
}

/// A gradient in the source space of a map, given that in its target space: the map's transpose times the gradient.
template <class N>
HWY_INLINE Vector3<N> transformed_gradient(const glm::dmat4& map, const Vector3<N>& gradient)
{
    const auto coordinate = [&](int axis) HWY_ATTR { return dot(constant_vector<N>(glm::dvec3(map[axis])), gradient); };
    return {coordinate(0), coordinate(1), coordinate(2)};
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
