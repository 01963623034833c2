// The roots of a ray in a cell, scalar and in double precision: used where single precision cannot decide.
// Included once for each SIMD target.
#include "isospline/cell/lattice_ray.h"
#include "isospline/cell/polynomial-inl.h"
#include "isospline/cell/root_in_cell.h"
#include "isospline/cell/value-inl.h"
#include "isospline/math/roots-inl.h"

#include <optional>
#include <vector>

#if defined(ISOSPLINE_CELL_REFERENCE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_REFERENCE_INL_H
#undef ISOSPLINE_CELL_REFERENCE_INL_H
#else
#define ISOSPLINE_CELL_REFERENCE_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// f - level along the segment of a ray that belongs to a cell. Its values at the ends equal those of the cells before
/// and behind, bit for bit.
template <int Degree>
Bernstein<3 * Degree> reference_polynomial(const CellCoefficients& cell, const LatticeRay& ray, const Interval& inside)
{
    return bernstein_along_segment<Degree>(cell, ray.local_end(inside.t_near, cell.lower),
                                           ray.local_end(inside.t_far, cell.lower));
}

/// Calls `visit(root, rising)` for the roots in a cell's segment that are within the ray's limits, in ascending order,
/// until it returns false.
template <int Degree, typename Visit>
void for_each_root_in_segment(const CellCoefficients& cell, const LatticeRay& ray, const Interval& inside,
                              const Visit& visit)
{
    for_each_root<3 * Degree>(reference_polynomial<Degree>(cell, ray, inside), [&](double s, bool rising) HWY_ATTR {
        const double end = inside.t_near + s * (inside.t_far - inside.t_near);
        const double t = end < inside.t_far ? end : inside.t_far;
        return !ray.is_within_limits(t) ||
               visit(RootInCell{t, gradient_in_cell<Degree>(cell, ray.at(t) - cell.lower)}, rising);
    });
}

/// The first root.
template <int Degree>
HWY_NOINLINE std::optional<RootInCell> first_reference_root(const CellCoefficients& cell, const LatticeRay& ray,
                                                            const Interval& inside)
{
    std::optional<RootInCell> first;
    for_each_root_in_segment<Degree>(cell, ray, inside, [&](const RootInCell& root, bool) {
        first = root;
        return false;
    });
    return first;
}

/// Appends all roots.
template <int Degree>
HWY_NOINLINE void all_reference_roots(const CellCoefficients& cell, const LatticeRay& ray, const Interval& inside,
                                      std::vector<CrossingInCell>& crossings)
{
    for_each_root_in_segment<Degree>(cell, ray, inside, [&](const RootInCell& root, bool rising) {
        crossings.push_back({root, rising});
        return true;
    });
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
