// Lines across a face of a cell, cut with the surface in SIMD lanes.
#pragma once

#include "isospline/spline/degree.h"

#include <glm/mat3x3.hpp>

#include <array>
#include <cstddef>
#include <vector>

namespace isospline {

/// The nodes of a rule along one coordinate of a face, with weights of three rules. They are padded to groups of lanes
/// by nodes without weight.
struct LineNodes {
    static constexpr std::size_t group = 8;
    static constexpr std::size_t most = 128; ///< nodes, with the padding

    std::size_t count = 0;                      ///< without the padding
    std::array<std::vector<double>, 3> values;  ///< of each Bernstein polynomial at the nodes
    std::array<std::vector<double>, 3> slopes;  ///< of its derivative
    std::array<std::vector<double>, 3> weights; ///< of each rule
};

/// f over a face of a cell of degree 1 or 2, with what is wanted of the lines across the face.
struct LinesOverFace {
    int degree;
    /// Bernstein coefficients by the first coordinate of the face, the second one, and the axis across it.
    std::array<std::array<std::array<double, 3>, 3>, 3> c;
    glm::dmat3 metric; ///< g M g is the square of a gradient in world units; by the same coordinates
    bool volume, area;
};

/// Sums over lines by three rules.
struct LineSumsOverFace {
    std::array<double, 3> volume{}, area{};
};

/// The lengths of lines in the solid, where f >= 0, in lattice units, and the areas that their crossings stand for:
/// |g|_M |g_axis| / |g|^2, g being the gradient. The sums do not depend on the SIMD target.
LineSumsOverFace sum_lines(const LinesOverFace& face, const LineNodes& nodes);

} // namespace isospline
