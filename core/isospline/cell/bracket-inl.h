// The paper's §4: opposite signs where the ray enters and leaves a cell, then Brent's method. Included once for each
// SIMD target.
#include "isospline/cell/lattice_ray.h"
#include "isospline/cell/root_in_cell.h"
#include "isospline/cell/value-inl.h"
#include "isospline/math/brent.h"

#include <algorithm>
#include <optional>

#if defined(ISOSPLINE_CELL_BRACKET_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_BRACKET_INL_H
#undef ISOSPLINE_CELL_BRACKET_INL_H
#else
#define ISOSPLINE_CELL_BRACKET_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// How close Brent's method gets to the root, as a fraction of the ray's way through the cell.
constexpr double bracket_tolerance = 1e-12;

/// A root of f - level along the ray inside the cell if f1 f2 <= 0 holds for the values where the ray enters, or
/// begins, and where it leaves, or ends; otherwise nothing. It misses an even number of roots in one cell, and finds
/// any one of an odd number: this is the paper's method, unchanged, for comparison.
template <int Degree>
std::optional<RootInCell> bracket_first_root(const CellCoefficients& cell, const LatticeRay& ray)
{
    const Interval segment = ray.inside_cell(cell.lower);
    const Interval inside{std::max(segment.t_near, ray.t_near), std::min(segment.t_far, ray.t_far)};
    if (!(inside.t_near < inside.t_far))
        return std::nullopt;

    const glm::dvec3 entry = ray.local_end(inside.t_near, cell.lower);
    const glm::dvec3 through = ray.local_end(inside.t_far, cell.lower) - entry;
    const auto value = [&](double s) HWY_ATTR { return value_in_cell<Degree>(cell, entry + s * through); };
    const FunctionPoint first{0.0, value(0.0)}, last{1.0, value(1.0)};
    // f1 f2 <= 0, by signs: the product of two tiny values of one sign would underflow to zero.
    if ((first.value > 0.0 && last.value > 0.0) || (first.value < 0.0 && last.value < 0.0))
        return std::nullopt;
    const double s = first.value == 0.0 ? 0.0 : brent_root(value, first, last, bracket_tolerance);
    const double t = inside.t_near + s * (inside.t_far - inside.t_near);
    if (!ray.is_within_limits(t))
        return std::nullopt;
    return RootInCell{t, gradient_in_cell<Degree>(cell, ray.at(t) - cell.lower)};
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
