// Integrals over the solid and the surface in one cell, by lines along the axes: fast, and of moderate precision.
#pragma once

#include "isospline/cell/coefficients.h"
#include "isospline/measure/cell_quadrature.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <memory>

namespace isospline {

/// Integrals over the cells of a brick along lines, and of what their errors are estimated; see CellLines.
struct LineSums {
    static constexpr std::size_t column_count = 12; ///< of 4 x 4 x 8 cells: four along each axis

    std::array<double, quantity_count> value{}, magnitude{}; ///< magnitude: of the absolute value
    struct Column {
        std::array<double, quantity_count> deviation{}, halves_of_pairs{}, halves_of_others{};
    };
    std::array<Column, column_count> columns;
    std::size_t cells = 0; ///< that the surface may cross

    /// The column of a cell along an axis, at this place of the plane across it.
    static std::size_t column(int axis, int x, int y)
    {
        return static_cast<std::size_t>(4 * axis + x / 4 % 2 + 2 * (y / 4 % 2));
    }
    static int axis_of(std::size_t column) { return static_cast<int>(column) / 4; }
};

/// Integrates over cells along lines, in world units. One thread at a time.
///
/// On the surface, the squares of the components of the unit normal m in lattice space sum to one. So
///
///     integral of g dA = sum over axes of the integral over the face across the axis of the sum over all crossings of
///     g |m_axis|,
///
/// where the integrand is bounded: |m_axis| falls to zero where a line along the axis touches the surface. Crossings
/// are the roots of polynomials of one variable. The surface is not divided, so no graph, edge or corner has to be
/// found. The volume is the integral of the lengths of lines along the axis that is nearest to the normal.
///
/// Lines are at the nodes of an integration lattice with a random shift, the same in all cells that a line crosses, and
/// every other node is mirrored (R. Cranley and T. N. L. Patterson, "Randomization of number theoretic methods for
/// multiple integration", SIAM Journal on Numerical Analysis 13(6), 1976; F. J. Hickernell, "Obtaining O(N^(-2+e))
/// convergence for lattice quadrature rules", in: Monte Carlo and Quasi-Monte Carlo Methods 2000). So the expected
/// value of a sum is the integral, whatever the surface has in common with the lattice, and the errors of lines through
/// different columns of cells are independent. Within a cell their error is large where the surface leaves it through a
/// face across the axis, but there, the same lines continue in the next cell: only the sums over many cells are
/// precise.
///
/// One of 2 x 2 columns of cells, chosen at random, has two lattices. The difference of the sums by both, times a
/// factor, is the deviation. The square of its sum over a set of columns is an estimate of the variance of the error.
/// Where few columns have most of the error, those with two lattices may have none of it. So the halves of each lattice
/// are compared, too: their differences are larger than the error, and tell whether the other columns are like those.
class CellLines {
public:
    /// Whether lines are cut in SIMD lanes.
    static bool has_lanes(int degree, bool curvature) { return degree <= 2 && !curvature; }

    /// `options.order`: the number of rows of lines, even; see LineLattice.
    explicit CellLines(int degree, const QuadratureOptions& options);
    ~CellLines();
    CellLines(CellLines&&) noexcept;

    /// Adds the integrals over the cell at `place` of the lattice, which no half-space cuts. Returns false, and adds
    /// nothing, if a Bernstein coefficient of f equals the level: then faces, edges or corners of the cell may be in
    /// the surface.
    bool add(const CellCoefficients& cell, const glm::ivec3& place, double sign, LineSums& to);

private:
    struct Method;
    template <int Degree>
    struct MethodOfDegree;

    std::unique_ptr<Method> method_;
};

} // namespace isospline
