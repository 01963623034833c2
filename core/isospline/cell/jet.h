// f - level with its first and second derivatives at a point of one cell.
#pragma once

#include "isospline/cell/coefficients.h"
#include "isospline/spline/cell_weights-inl.h"

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

namespace isospline {

/// f - level with its derivatives by local coordinates.
struct Jet {
    double value = 0.0;
    glm::dvec3 gradient{0.0};
    glm::dmat3 hessian{0.0};
};

template <int Degree>
inline Jet jet_in_cell(const CellCoefficients& cell, const glm::dvec3& local)
{
    const auto x = scalar::cell_basis<Degree>(local.x), y = scalar::cell_basis<Degree>(local.y),
               z = scalar::cell_basis<Degree>(local.z);
    Jet jet;
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j) {
            double line = 0.0, first = 0.0, second = 0.0;
            for (int i = 0; i <= Degree; ++i) {
                const double coefficient = cell(i, j, k);
                line += x.values[i] * coefficient;
                first += x.first[i] * coefficient;
                second += x.second[i] * coefficient;
            }
            const double yz = y.values[j] * z.values[k];
            jet.value += yz * line;
            jet.gradient += glm::dvec3(yz * first, y.first[j] * z.values[k] * line, y.values[j] * z.first[k] * line);
            jet.hessian[0][0] += yz * second;
            jet.hessian[1][1] += y.second[j] * z.values[k] * line;
            jet.hessian[2][2] += y.values[j] * z.second[k] * line;
            jet.hessian[0][1] += y.first[j] * z.values[k] * first;
            jet.hessian[0][2] += y.values[j] * z.first[k] * first;
            jet.hessian[1][2] += y.first[j] * z.first[k] * line;
        }
    jet.hessian[1][0] = jet.hessian[0][1];
    jet.hessian[2][0] = jet.hessian[0][2];
    jet.hessian[2][1] = jet.hessian[1][2];
    return jet;
}

} // namespace isospline
