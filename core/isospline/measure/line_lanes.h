// Lines across a face of a cell, cut with the surface in SIMD lanes.
#pragma once

#include <glm/mat3x3.hpp>

#include <array>

namespace isospline {

/// A line at each of the nodes along the first coordinate of a face and each of those along the second one, all of the
/// same weight.
struct LineGrid {
    static constexpr int group = 8;  ///< the number of nodes along the second coordinate is a multiple of it
    static constexpr int most = 128; ///< nodes along a coordinate

    std::array<int, 2> counts;    ///< of nodes, even
    std::array<double, 2> shifts; ///< in [0, 1)

    /// The place of a node along a coordinate. Two neighbours have their middle where it is for any shift, so linear
    /// functions are integrated exactly.
    double position(std::size_t coordinate, int i) const
    {
        return (i + (i % 2 == 0 ? shifts[coordinate] : 1.0 - shifts[coordinate])) / counts[coordinate];
    }
};

/// f over a face of a cell of degree 1 or 2, with what is wanted of the lines across the face.
struct LinesOverFace {
    int degree;
    /// Bernstein coefficients by the first coordinate of the face, the second one, and the axis across it. The largest
    /// absolute value is about 1.
    std::array<std::array<std::array<float, 3>, 3>, 3> c;
    /// g M g is the square of a gradient, by the same coordinates, in units in which the largest element is 1.
    glm::mat3 metric;
    bool volume, area;
};

/// Means over lines.
struct LineMeansOverFace {
    double volume = 0.0, area = 0.0;
};

/// The lengths of lines in the solid, where f >= 0, in lattice units, and the areas that their crossings stand for:
/// |g|_M |g_axis| / |g|^2, g being the gradient. In single precision; the means do not depend on the SIMD target.
LineMeansOverFace mean_over_lines(const LinesOverFace& face, const LineGrid& grid);

} // namespace isospline
