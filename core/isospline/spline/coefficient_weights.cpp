#include "isospline/spline/coefficient_weights.h"

#include "isospline/math/affine.h"
#include "isospline/math/grid.h"
#include "isospline/spline/basis.h"
#include "isospline/spline/line_filter.h"

#include <array>

namespace isospline {

void set_coefficient_weights(const Volume& volume, const glm::ivec3& cell, const glm::dvec3& index,
                             const glm::dmat4& to_index, std::span<CoefficientWeight> weights)
{
    const int degree = volume.degree();
    const glm::ivec3 first = cell - degree / 2;
    std::array<std::array<int, 4>, 3> at;
    std::array<std::array<BasisValue, 4>, 3> basis;
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i <= degree; ++i) {
            const auto a = static_cast<std::size_t>(axis), k = static_cast<std::size_t>(i);
            at[a][k] = detail::inside_index(first[axis] + i, volume.shape()[axis], volume.boundary());
            basis[a][k] = bspline(degree, index[axis] - (first[axis] + i));
        }
    std::size_t next = 0;
    const auto count = static_cast<std::size_t>(degree) + 1;
    for (std::size_t k = 0; k < count; ++k)
        for (std::size_t j = 0; j < count; ++j)
            for (std::size_t i = 0; i < count; ++i, ++next) {
                const BasisValue &x = basis[0][i], &y = basis[1][j], &z = basis[2][k];
                const glm::dvec3 gradient(x.derivative * y.value * z.value, x.value * y.derivative * z.value,
                                          x.value * y.value * z.derivative);
                weights[next] = {static_cast<std::int64_t>(place_in(volume.shape(), {at[0][i], at[1][j], at[2][k]})),
                                 x.value * y.value * z.value, transform_gradient(to_index, gradient)};
            }
}

} // namespace isospline
