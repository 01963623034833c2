// The first point of the surface along rays inside one cell.
#pragma once

#include "isospline/cell/candidate_cells.h"
#include "isospline/cell/coefficients.h"
#include "isospline/cell/lattice_ray.h"
#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/cell/method.h"
#include "isospline/cell/root_in_cell.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace isospline {

/// Called for a crossing of the ray in a lane of a packet, with the t at which the ray enters the cell.
struct RootVisitor {
    void (*visit)(void* context, int lane, const CrossingInCell& crossing, double t_begin);
    void* context;
};

/// The ways to ask for roots in a cell, for one degree and method.
///
/// In a cell, g(s) = f(p0 + s (p1 - p0)) is one polynomial of degree 3n, p0 and p1 being where the ray enters and
/// leaves. Method::exact computes its Bernstein coefficients in single precision, with a bound on their rounding; where
/// they prove that there is no root, the cell is done. Where they prove that there is exactly one, Newton's method
/// refines it in double precision. All other cases are solved in double precision from the start. Method::reference
/// does that for all rays, one after the other. Method::bracket is the paper's §4.
///
/// At a crossing, f goes from below the level to the level or above it, or back. It belongs to exactly one cell, even
/// on a face, an edge or a corner of cells (docs/method.md). A single ray, a ray in a packet and Method::reference find
/// the same root, bit for bit.
struct CellIntersector {
    /// The least t within the ray's limits where f crosses the level inside the cell, or nothing.
    std::optional<RootInCell> (*first_root)(const CellCoefficients& cell, const LatticeRay& ray);
    /// Whether there is a crossing within the ray's limits.
    bool (*any_root)(const CellCoefficients& cell, const LatticeRay& ray);
    /// Appends all crossings in ascending order; Method::bracket appends the one that it finds.
    void (*all_roots)(const CellCoefficients& cell, const LatticeRay& ray, std::vector<CrossingInCell>& crossings);
    /// The first crossings of the rays of a packet, each in its own cell: returns the lanes with one at t_limit[lane]
    /// or before, and sets these lanes of `roots`; the other lanes have no meaning. The roots do not depend on t_limit,
    /// nor therefore on the order of the cells.
    LaneMask (*first_roots)(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays,
                            const double* t_limit, RootPacket& roots);
    /// The lanes of a packet whose rays have a crossing within their limits, each in its own cell.
    LaneMask (*any_roots)(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays);
    /// The same lanes, and the number of crossings of each of them.
    LaneMask (*count_roots)(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays,
                            std::uint8_t* counts);
    /// Visits all crossings of the rays of a packet within their limits, each in its own cell, in any order.
    void (*visit_roots)(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays,
                        const RootVisitor& visitor);
};

/// The intersector of a method for degree 1, 2 or 3; for Method::exact, the one for the widest SIMD target of the
/// machine.
CellIntersector cell_intersector(int degree, Method method);

} // namespace isospline
