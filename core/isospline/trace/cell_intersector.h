// The first point of the surface along a ray inside one cell.
#pragma once

#include "isospline/shell/isosurface.h"
#include "isospline/trace/cell_block.h"
#include "isospline/trace/lattice_ray.h"

#include <optional>

namespace isospline {

/// Returns the least t in [ray.t_near, ray.t_far] where f crosses the level inside the cell, or nothing.
using CellIntersector = std::optional<double> (*)(const CellBlock& cell, const LatticeRay& ray);

/// The intersector of a method for a degree of 1, 2 or 3; for Method::exact the one of the widest SIMD target that the
/// machine has.
///
/// In a cell, g(s) = f(p0 + s (p1 - p0)) is one polynomial of degree 3n, p0 and p1 being where the ray enters and
/// leaves. Method::exact evaluates it at 3n+1 Chebyshev-Lobatto nodes in single precision, SIMD lanes being the nodes,
/// and turns the values into Bernstein coefficients; where all of those have one sign by more than a bound on their
/// rounding, the cell holds no root. All other cells are decided, and solved, in double precision. Method::reference is
/// the same without the filter, scalar, in double precision. Method::bracket is the paper's §4.
CellIntersector cell_intersector(int degree, Method method);

} // namespace isospline
