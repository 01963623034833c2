// Integrals over the solid and the surface in one cell, by lines along the axes: fast, and of moderate precision.
#pragma once

#include "isospline/cell/coefficients.h"
#include "isospline/measure/cell_quadrature.h"

#include <array>
#include <cstddef>
#include <memory>

namespace isospline {

/// Integrals by a rule and by two coarser ones, whose differences from the first show its error.
struct LineSums {
    std::array<std::array<double, quantity_count>, 3> rules{}; ///< the fine one first
    std::array<double, quantity_count> magnitude{};            ///< by the fine one, of the absolute values
    std::size_t cells = 0;                                     ///< that the surface may cross
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
/// Lines are at the nodes of Gauss-Legendre rules. Within a cell their error is large where the surface leaves it
/// through a face across the axis, but there, the same lines continue in the next cell: only the sums over many cells
/// are precise.
class CellLines {
public:
    /// Whether lines are cut in SIMD lanes.
    static bool has_lanes(int degree, bool curvature) { return degree <= 2 && !curvature; }

    explicit CellLines(int degree, const QuadratureOptions& options);
    ~CellLines();
    CellLines(CellLines&&) noexcept;

    /// Adds the integrals over a cell that no half-space cuts. Returns false, and adds nothing, if a Bernstein
    /// coefficient of f equals the level: then faces, edges or corners of the cell may be in the surface.
    bool add(const CellCoefficients& cell, double sign, LineSums& to) const;

private:
    struct Method;
    template <int Degree>
    struct MethodOfDegree;

    std::unique_ptr<Method> method_;
};

} // namespace isospline
