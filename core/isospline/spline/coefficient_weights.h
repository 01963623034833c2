// The model at a point as a weighted sum of coefficients.
#pragma once

#include "isospline/spline/volume.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace isospline {

/// One of the coefficients that influence a point, with its B-spline B there.
struct CoefficientWeight {
    std::int64_t place = 0;   ///< in the grid of samples, x + nx (y + ny z)
    double weight = 0.0;      ///< B
    glm::dvec3 gradient{0.0}; ///< of B
};

/// Their number, (n+1)^3.
inline std::size_t coefficient_count(const Volume& volume)
{
    const auto along_axis = static_cast<std::size_t>(volume.degree()) + 1;
    return along_axis * along_axis * along_axis;
}

/// Sets the weights of a point, which is given in index space and in a cell; the cell may be beyond the domain.
/// Gradients are in the space that `to_index` maps.
void set_coefficient_weights(const Volume& volume, const glm::ivec3& cell, const glm::dvec3& index,
                             const glm::dmat4& to_index, std::span<CoefficientWeight> weights);

} // namespace isospline
