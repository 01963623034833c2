// The first point of the surface along rays inside one cell.
#pragma once

#include "isospline/cell/coefficients.h"
#include "isospline/cell/lattice_ray.h"
#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/cell/method.h"
#include "isospline/cell/root_in_cell.h"

#include <optional>
#include <vector>

namespace isospline {

/// The ways to ask for roots in a cell, for one degree and method.
///
/// In a cell, g(s) = f(p0 + s (p1 - p0)) is one polynomial of degree 3n, p0 and p1 being where the ray enters and
/// leaves. Method::exact computes its Bernstein coefficients in single precision, with a bound on their rounding; where
/// they prove that there is no root, the cell is done, and where they prove that there is exactly one, Newton's method
/// takes it to double precision. All other rays are decided, and solved, in double precision. Method::reference does
/// all of it so, one ray after the other. Method::bracket is the paper's §4.
///
/// A crossing is where f goes from below the level to the level or above it, or back. It belongs to one cell, also on a
/// face, an edge or a corner of cells (docs/method.md). A ray alone, a ray in a packet and Method::reference find the
/// same root, bit for bit.
struct CellIntersector {
    /// The least t within the ray's limits where f crosses the level inside the cell, or nothing.
    std::optional<RootInCell> (*first_root)(const CellCoefficients& cell, const LatticeRay& ray);
    /// Whether there is one.
    bool (*any_root)(const CellCoefficients& cell, const LatticeRay& ray);
    /// Appends all of them, in ascending order; with Method::bracket the one that it finds.
    void (*all_roots)(const CellCoefficients& cell, const LatticeRay& ray, std::vector<CrossingInCell>& crossings);
    /// The first ones of the active lanes of a packet: returns those that have one at t_limit[lane] or before, and sets
    /// these lanes of `roots`; others have no meaning. What is found does not depend on t_limit, and so on the order of
    /// the cells.
    LaneMask (*first_roots)(const CellCoefficients& cell, const LatticeRayPacket& rays, const double* t_limit,
                            LaneMask active, RootPacket& roots);
};

/// The intersector of a method for a degree of 1, 2 or 3; for Method::exact the one of the widest SIMD target that the
/// machine has.
CellIntersector cell_intersector(int degree, Method method);

} // namespace isospline
