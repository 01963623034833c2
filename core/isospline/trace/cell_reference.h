// The roots of a ray in a cell, scalar and in double precision: the last word where single precision cannot decide.
#pragma once

#include "isospline/math/roots.h"
#include "isospline/trace/lattice_ray.h"
#include "isospline/trace/ray_polynomial.h"
#include "isospline/trace/root_in_cell.h"

#include <algorithm>
#include <optional>
#include <vector>

namespace isospline {

/// f - level along the segment of a ray that belongs to a cell, as reference_first_root() and reference_all_roots() see
/// it. Its values at the ends are those that the cells before and behind have there, bit for bit: all of them begin
/// with coefficients that the cells share, in the same order.
template <int Degree>
Bernstein<3 * Degree> reference_polynomial(const CellBlock& cell, const LatticeRay& ray, const Interval& inside)
{
    return bernstein_along_segment<Degree>(cell, ray.local_end(inside.t_near, cell.lower),
                                           ray.local_end(inside.t_far, cell.lower));
}

/// Calls `visit(root, rising)` for the roots in a cell's segment that are within the ray's limits, in ascending order,
/// until it returns false.
template <int Degree, typename Visit>
void reference_for_each_root(const CellBlock& cell, const LatticeRay& ray, const Interval& inside, const Visit& visit)
{
    for_each_root<3 * Degree>(reference_polynomial<Degree>(cell, ray, inside), [&](double s, bool rising) {
        const double t = std::min(inside.t_near + s * (inside.t_far - inside.t_near), inside.t_far);
        return !ray.is_within_limits(t) ||
               visit(RootInCell{t, gradient_in_cell<Degree>(cell, ray.at(t) - cell.lower)}, rising);
    });
}

/// The first of them.
template <int Degree>
std::optional<RootInCell> reference_first_root(const CellBlock& cell, const LatticeRay& ray, const Interval& inside)
{
    std::optional<RootInCell> first;
    reference_for_each_root<Degree>(cell, ray, inside, [&](const RootInCell& root, bool) {
        first = root;
        return false;
    });
    return first;
}

/// Appends all of them.
template <int Degree>
void reference_all_roots(const CellBlock& cell, const LatticeRay& ray, const Interval& inside,
                         std::vector<CrossingInCell>& crossings)
{
    reference_for_each_root<Degree>(cell, ray, inside, [&](const RootInCell& root, bool rising) {
        crossings.push_back({root, rising});
        return true;
    });
}

} // namespace isospline
