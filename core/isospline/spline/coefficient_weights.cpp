#include "isospline/spline/coefficient_weights.h"

#include "isospline/math/affine.h"
#include "isospline/math/grid.h"
#include "isospline/spline/cell_weights-inl.h"
#include "isospline/spline/degree.h"
#include "isospline/spline/line_filter.h"

#include <array>

namespace isospline {

namespace {

template <int Degree>
void set_weights_of_degree(const Volume& volume, const glm::ivec3& cell, const glm::dvec3& index,
                           const glm::dmat4& to_index, std::span<CoefficientWeight> weights)
{
    constexpr std::size_t count = Degree + 1;
    const glm::ivec3 first = cell - Degree / 2;
    const glm::dvec3 local = index + volume.lattice_shift() - glm::dvec3(cell);
    std::array<std::array<int, count>, 3> at;
    std::array<std::array<double, count>, 3> values, slopes;
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        values[a] = scalar::cell_weights<Degree>(local[axis]);
        slopes[a] = scalar::cell_derivatives<Degree>(local[axis]);
        for (int i = 0; i <= Degree; ++i)
            at[a][static_cast<std::size_t>(i)] =
                detail::inside_index(first[axis] + i, volume.shape()[axis], volume.boundary());
    }
    std::size_t next = 0;
    for (std::size_t k = 0; k < count; ++k)
        for (std::size_t j = 0; j < count; ++j)
            for (std::size_t i = 0; i < count; ++i, ++next) {
                const double x = values[0][i], y = values[1][j], z = values[2][k];
                const glm::dvec3 gradient(slopes[0][i] * y * z, x * slopes[1][j] * z, x * y * slopes[2][k]);
                weights[next] = {static_cast<std::int64_t>(place_in(volume.shape(), {at[0][i], at[1][j], at[2][k]})),
                                 x * y * z, transform_gradient(to_index, gradient)};
            }
}

} // namespace

void set_coefficient_weights(const Volume& volume, const glm::ivec3& cell, const glm::dvec3& index,
                             const glm::dmat4& to_index, std::span<CoefficientWeight> weights)
{
    dispatch_degree<0, 5>(volume.degree(),
                          [&](auto degree) { set_weights_of_degree<degree>(volume, cell, index, to_index, weights); });
}

} // namespace isospline
