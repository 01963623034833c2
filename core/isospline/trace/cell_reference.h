// The roots of a ray in a cell, scalar and in double precision: the last word where single precision cannot decide.
#pragma once

#include "isospline/math/roots.h"
#include "isospline/trace/lattice_ray.h"
#include "isospline/trace/ray_polynomial.h"
#include "isospline/trace/root_in_cell.h"

#include <optional>
#include <vector>

namespace isospline {

/// The first root in an interval in which the ray is inside the cell.
template <int Degree>
std::optional<RootInCell> reference_first_root(const CellBlock& cell, const glm::dvec3& origin,
                                               const glm::dvec3& direction, const Interval& inside)
{
    const auto local = [&](double t) { return (origin + t * direction) - cell.lower; };
    const std::optional<double> s =
        first_root<3 * Degree>(bernstein_along_segment<Degree>(cell, local(inside.t_near), local(inside.t_far)));
    if (!s)
        return std::nullopt;
    const double t = inside.t_near + *s * (inside.t_far - inside.t_near);
    return RootInCell{t, gradient_in_cell<Degree>(cell, local(t))};
}

/// Appends all roots, in ascending order.
template <int Degree>
void reference_all_roots(const CellBlock& cell, const LatticeRay& ray, std::vector<CrossingInCell>& crossings)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (inside.t_near > inside.t_far)
        return;
    const auto local = [&](double t) { return ray.at(t) - cell.lower; };
    for_each_root<3 * Degree>(bernstein_along_segment<Degree>(cell, local(inside.t_near), local(inside.t_far)),
                              [&](double s, bool rising) {
                                  const double t = inside.t_near + s * (inside.t_far - inside.t_near);
                                  crossings.push_back({{t, gradient_in_cell<Degree>(cell, local(t))}, rising});
                                  return true;
                              });
}

} // namespace isospline
