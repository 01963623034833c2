// Lines across a face of a cell, cut with the surface in SIMD lanes.
#pragma once

#include <glm/mat3x3.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace isospline {

/// Lines in rows along the second coordinate of a face, all of the same weight: an integration lattice. The lines of a
/// row are shifted by the golden ratio beside those of the row before, so few rows see as much of the face as many do.
struct LineLattice {
    static constexpr int group = 8; ///< lines in a row

    int rows;                     ///< even
    std::array<double, 2> shifts; ///< in [0, 1)

    /// The place of a row along the first coordinate. Two neighbours have their middle where it is for any shift, and
    /// so have lines in a row: linear functions are integrated exactly.
    double row(int i) const { return mirrored(i, shifts[0]) / rows; }
    double shift_of_row(int i) const
    {
        const double shift = shifts[1] + i * (std::numbers::phi - 1.0);
        return shift - std::floor(shift);
    }
    /// The place of a line of a row with this shift along the second coordinate.
    static double line(int i, double shift) { return mirrored(i, shift) / group; }

private:
    static double mirrored(int i, double shift) { return i + (i % 2 == 0 ? shift : 1.0 - shift); }
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

/// Sums over lines, apart for two halves of each row.
struct LineSumsOverFace {
    /// The half of a line. A half is its own mirror image, so that symmetric surfaces have halves that differ.
    static constexpr std::size_t half_of(std::size_t i) { return (i + 1) / 2 % 2; }

    std::array<double, 2> volumes{}, areas{};
};

/// The lengths of lines in the solid, where f >= 0, in lattice units, and the areas that their crossings stand for:
/// |g|_M |g_axis| / |g|^2, g being the gradient. In single precision; the sums do not depend on the SIMD target.
LineSumsOverFace sum_over_lines(const LinesOverFace& face, const LineLattice& lattice);

} // namespace isospline
