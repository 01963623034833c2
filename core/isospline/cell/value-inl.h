// f - level and its gradient at points of one cell. Included once for each SIMD target.
#include "isospline/cell/coefficients.h"
#include "isospline/spline/cell_weights-inl.h"

#include <glm/vec3.hpp>

#include <array>
#include <type_traits>

#if defined(ISOSPLINE_CELL_VALUE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_VALUE_INL_H
#undef ISOSPLINE_CELL_VALUE_INL_H
#else
#define ISOSPLINE_CELL_VALUE_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// f - level at local coordinates in [0, 1]^3, a glm::dvec3 or three numbers; coefficient(i, j, k) is less the
/// threshold, as in CellCoefficients.
template <int Degree, class Coefficients, class Point>
HWY_INLINE auto value_in_cell(const Coefficients& coefficient, const Point& local)
{
    return weighted_sum(coefficient, cell_weights<Degree>(local[0]), cell_weights<Degree>(local[1]),
                        cell_weights<Degree>(local[2]));
}

template <class N>
struct ValueAndGradient {
    N value;
    std::array<N, 3> gradient; ///< of f, by lattice coordinates
};

/// The value and the gradient.
template <int Degree, class Coefficients, class Point>
HWY_INLINE auto value_and_gradient_in_cell(const Coefficients& coefficient, const Point& local)
{
    using N = std::remove_cvref_t<decltype(local[0])>;
    const auto x = cell_weights<Degree>(local[0]), y = cell_weights<Degree>(local[1]),
               z = cell_weights<Degree>(local[2]);
    const auto dx = cell_derivatives<Degree>(local[0]), dy = cell_derivatives<Degree>(local[1]),
               dz = cell_derivatives<Degree>(local[2]);
    const N zero = number<N>(0.0);
    ValueAndGradient<N> sum{zero, {zero, zero, zero}};
    for (int k = 0; k <= Degree; ++k) {
        // The value of one plane, and its derivatives with respect to x and y.
        N plane = zero, plane_dx = zero, plane_dy = zero;
        for (int j = 0; j <= Degree; ++j) {
            const N first = in_lanes<N>(coefficient(0, j, k));
            N line = x[0] * first, line_dx = dx[0] * first;
            for (int i = 1; i <= Degree; ++i) {
                const N next = in_lanes<N>(coefficient(i, j, k));
                line = mul_add(x[i], next, line);
                line_dx = mul_add(dx[i], next, line_dx);
            }
            plane = mul_add(y[j], line, plane);
            plane_dx = mul_add(y[j], line_dx, plane_dx);
            plane_dy = mul_add(dy[j], line, plane_dy);
        }
        sum.value = mul_add(z[k], plane, sum.value);
        sum.gradient[0] = mul_add(z[k], plane_dx, sum.gradient[0]);
        sum.gradient[1] = mul_add(z[k], plane_dy, sum.gradient[1]);
        sum.gradient[2] = mul_add(dz[k], plane, sum.gradient[2]);
    }
    return sum;
}

/// Gradient of f, by lattice coordinates.
template <int Degree, class Coefficients>
HWY_INLINE glm::dvec3 gradient_in_cell(const Coefficients& coefficient, const glm::dvec3& local)
{
    const auto [x, y, z] = value_and_gradient_in_cell<Degree>(coefficient, local).gradient;
    return {x, y, z};
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
