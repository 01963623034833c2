// A line in lattice space, prepared for the planes of the lattice: for one ray, or for one ray per SIMD lane. Included
// once for each SIMD target.
#include "isospline/cell/lattice_ray.h"
#include "isospline/math/vector-inl.h"

#if defined(ISOSPLINE_CELL_LATTICE_LINE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_LATTICE_LINE_INL_H
#undef ISOSPLINE_CELL_LATTICE_LINE_INL_H
#else
#define ISOSPLINE_CELL_LATTICE_LINE_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// The members of LatticeRay, for one axis instead of three.
template <class N>
struct LatticeLine {
    N plane_origin, inverse_direction;
};

/// For a coordinate that is constant along a line: the middle of the cell that the line belongs to. A line that
/// runs in a plane of the lattice belongs to the cell above it, or at the upper border of the grid to the cell below.
template <class N>
HWY_INLINE N middle_of_cell(N coordinate, int cell_count)
{
    const N one = number<N>(1.0), zero = number<N>(0.0);
    const auto at_border = equal(coordinate, number<N>(cell_count));
    return rounded_to_floor(coordinate) - select(at_border, one, zero) + number<N>(0.5);
}

template <class N>
HWY_INLINE LatticeLine<N> lattice_line(N origin, N direction, int cell_count)
{
    const auto has_inverse = less(number<N>(1.0 / huge_inverse), absolute(direction));
    const N huge = with_sign_of(number<N>(huge_inverse), direction);
    return {select(has_inverse, origin, middle_of_cell(origin, cell_count)),
            select(has_inverse, number<N>(1.0) / direction, huge)};
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
