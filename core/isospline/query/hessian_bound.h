// A bound on the second derivatives of f in a part of a cell.
#pragma once

#include "isospline/cell/jet.h"
#include "isospline/query/lattice_metric.h"

#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace isospline {

/// Bounds on a quadratic form v^T M v at v = v_t + v_n n, for a unit vector n and v_t perpendicular to it: it is at
/// most tangential |v_t|^2 + 2 mixed |v_t| |v_n| + normal v_n^2.
struct Bend {
    double tangential, mixed, normal;
};

/// Second derivatives of f in a cell, from those at one of its points and bounds on third derivatives. Third
/// derivatives are weighted means of third differences of the coefficients.
struct HessianBound {
    /// For `sign` times f; the columns of the frame, in world coordinates, are n and two unit vectors perpendicular to
    /// it.
    template <int Degree>
    static HessianBound at(const CellCoefficients& cell, const glm::dvec3& local, double sign,
                           const LatticeMetric& metric, const glm::dmat3& frame)
    {
        constexpr int count = Degree + 1;
        std::array<double, count * count * count> c;
        for (int k = 0; k < count; ++k)
            for (int j = 0; j < count; ++j)
                for (int i = 0; i < count; ++i)
                    c[static_cast<std::size_t>(i + count * (j + count * k))] = static_cast<double>(cell.row(j, k)[i]);
        constexpr int strides[3] = {1, count, count * count};
        HessianBound bound;
        const glm::dmat3 to_lattice = metric.to_lattice * frame;
        bound.hessian = sign * (glm::transpose(to_lattice) * jet_in_cell<Degree>(cell, local).hessian * to_lattice);
        for (int a = 0; a < 3; ++a)
            for (int b = a; b < 3; ++b)
                for (int d = b; d < 3; ++d) {
                    glm::ivec3 counts(count);
                    for (const int axis : {a, b, d})
                        counts[axis] -= 1;
                    const int x = strides[a], y = strides[b], z = strides[d];
                    double largest = 0.0;
                    for (int k = 0; k < counts.z; ++k)
                        for (int j = 0; j < counts.y; ++j)
                            for (int i = 0; i < counts.x; ++i) {
                                const double* const p = c.data() + i + count * (j + count * k);
                                const double difference =
                                    (p[x + y + z] - p[x + y] - p[x + z] + p[x]) - (p[y + z] - p[y] - p[z] + p[0]);
                                largest = std::max(largest, std::abs(difference));
                            }
                    bound.third[a][b][d] = bound.third[a][d][b] = bound.third[b][a][d] = bound.third[b][d][a] =
                        bound.third[d][a][b] = bound.third[d][b][a] = largest;
                }
        return bound;
    }

    /// The bound where coordinates differ from the point's by at most `reach`.
    Bend bend(const glm::dvec3& reach, const LatticeMetric& metric) const
    {
        // A matrix with entries of at most those of `change` adds at most the largest row sum, in the world.
        glm::dmat3 change(0.0);
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b)
                change[a][b] = third[a][b][0] * reach.x + third[a][b][1] * reach.y + third[a][b][2] * reach.z;
        const glm::dmat3& map = metric.to_lattice;
        const glm::dmat3 absolute(glm::abs(map[0]), glm::abs(map[1]), glm::abs(map[2]));
        const glm::dvec3 row_sums = glm::transpose(absolute) * (change * (absolute * glm::dvec3(1.0)));
        const double spread = std::max({row_sums.x, row_sums.y, row_sums.z});
        const double largest =
            0.5 * (hessian[1][1] + hessian[2][2]) + std::hypot(0.5 * (hessian[1][1] - hessian[2][2]), hessian[1][2]);
        return {largest + spread, std::hypot(hessian[0][1], hessian[0][2]) + spread, hessian[0][0] + spread};
    }

    glm::dmat3 hessian;                                        ///< in the frame
    std::array<std::array<std::array<double, 3>, 3>, 3> third; ///< bounds on third derivatives, in local coordinates
};

} // namespace isospline
