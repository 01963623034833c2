// Subdivision of cells and the signs of their coefficients, one cell a SIMD lane. Included once for each target.
#if defined(ISOSPLINE_SHELL_PRUNE_BLOCKS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_SHELL_PRUNE_BLOCKS_INL_H
#undef ISOSPLINE_SHELL_PRUNE_BLOCKS_INL_H
#else
#define ISOSPLINE_SHELL_PRUNE_BLOCKS_INL_H
#endif

#include "isospline/spline/basis.h"
#include "isospline/spline/cell_weights-inl.h"

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Arrays of coefficients, one a lane: coefficient i of all lanes is the vector at i * Lanes. The functions below work
/// along one axis of such an array. `Inner` is the number of coefficients over the faster axes, `Outer` over the slower
/// ones.
template <int Degree, typename Real>
struct Blocks {
    static constexpr std::size_t most_lanes = 64 / sizeof(Real);
    using Lanes = hn::CappedTag<Real, most_lanes>;
    static constexpr int coarse = Degree + 1; ///< coefficients along an axis that influence a cell
    static constexpr int fine = Degree + 2;   ///< the same at half the spacing

    /// The two-scale relation.
    template <int Outer, int Inner>
    static HWY_INLINE void subdivide(const Real* HWY_RESTRICT block, Real* HWY_RESTRICT finer)
    {
        const Lanes lanes;
        const std::size_t step = Inner * hn::Lanes(lanes);
        constexpr auto weights = two_scale_weights<Degree, Real>();
        for (int outer = 0; outer < Outer; ++outer)
            for (int inner = 0; inner < Inner; ++inner) {
                const Real* row = block + (outer * coarse * Inner + inner) * hn::Lanes(lanes);
                Real* out = finer + (outer * fine * Inner + inner) * hn::Lanes(lanes);
                const auto c0 = hn::Load(lanes, row);
                const auto c1 = hn::Load(lanes, row + step);
                if constexpr (Degree == 1) {
                    hn::Store(c0, lanes, out);
                    hn::Store(hn::Mul(hn::Set(lanes, weights[0]), hn::Add(c0, c1)), lanes, out + step);
                    hn::Store(c1, lanes, out + 2 * step);
                } else if constexpr (Degree == 2) {
                    const auto c2 = hn::Load(lanes, row + 2 * step);
                    const auto far = hn::Set(lanes, weights[0]);
                    const auto near = hn::Set(lanes, weights[1]);
                    hn::Store(hn::MulAdd(near, c0, hn::Mul(far, c1)), lanes, out);
                    hn::Store(hn::MulAdd(near, c1, hn::Mul(far, c0)), lanes, out + step);
                    hn::Store(hn::MulAdd(near, c1, hn::Mul(far, c2)), lanes, out + 2 * step);
                    hn::Store(hn::MulAdd(near, c2, hn::Mul(far, c1)), lanes, out + 3 * step);
                } else {
                    const auto c2 = hn::Load(lanes, row + 2 * step);
                    const auto c3 = hn::Load(lanes, row + 3 * step);
                    const auto far = hn::Set(lanes, weights[0]);
                    const auto half = hn::Set(lanes, weights[1]);
                    const auto near = hn::Set(lanes, weights[2]);
                    hn::Store(hn::Mul(half, hn::Add(c0, c1)), lanes, out);
                    hn::Store(hn::MulAdd(near, c1, hn::Mul(far, hn::Add(c0, c2))), lanes, out + step);
                    hn::Store(hn::Mul(half, hn::Add(c1, c2)), lanes, out + 2 * step);
                    hn::Store(hn::MulAdd(near, c2, hn::Mul(far, hn::Add(c1, c3))), lanes, out + 3 * step);
                    hn::Store(hn::Mul(half, hn::Add(c2, c3)), lanes, out + 4 * step);
                }
            }
    }

    /// Values of f at both ends and in the middle of the cell, from fine coefficients.
    template <int Outer, int Inner>
    static HWY_INLINE void corner_values(const Real* HWY_RESTRICT block, Real* HWY_RESTRICT values)
    {
        const Lanes lanes;
        const std::size_t step = Inner * hn::Lanes(lanes);
        using V = hn::Vec<Lanes>;
        constexpr auto weights = cell_weights<Degree>(0.0);
        for (int outer = 0; outer < Outer; ++outer)
            for (int inner = 0; inner < Inner; ++inner)
                for (int corner = 0; corner < 3; ++corner) {
                    const Real* row = block + ((outer * fine + corner) * Inner + inner) * hn::Lanes(lanes);
                    auto value = number<V>(weights[0]) * hn::Load(lanes, row);
                    for (std::size_t j = 1; j < Degree; ++j)
                        value = mul_add(number<V>(weights[j]), hn::Load(lanes, row + j * step), value);
                    hn::Store(value, lanes, values + ((outer * 3 + corner) * Inner + inner) * hn::Lanes(lanes));
                }
    }

    /// Smallest or largest coefficient of each half cell.
    template <int Outer, int Inner, bool Largest>
    static HWY_INLINE void extremes_of_halves(const Real* HWY_RESTRICT block, Real* HWY_RESTRICT extremes)
    {
        const Lanes lanes;
        const std::size_t step = Inner * hn::Lanes(lanes);
        for (int outer = 0; outer < Outer; ++outer)
            for (int inner = 0; inner < Inner; ++inner) {
                const Real* row = block + (outer * fine * Inner + inner) * hn::Lanes(lanes);
                auto shared = hn::Load(lanes, row + step);
                for (std::size_t j = 2; j <= Degree; ++j)
                    shared = extreme<Largest>(shared, hn::Load(lanes, row + j * step));
                const auto first = extreme<Largest>(hn::Load(lanes, row), shared);
                const auto second = extreme<Largest>(hn::Load(lanes, row + (fine - 1) * step), shared);
                Real* out = extremes + (outer * 2 * Inner + inner) * hn::Lanes(lanes);
                hn::Store(first, lanes, out);
                hn::Store(second, lanes, out + step);
            }
    }

    template <bool Largest, typename Vector>
    static HWY_INLINE Vector extreme(Vector a, Vector b)
    {
        if constexpr (Largest)
            return hn::Max(a, b);
        else
            return hn::Min(a, b);
    }
};

/// The signs of a set of numbers whose extremes are known to within a tolerance, per lane: bit l for lane l. Zero
/// counts as positive. With a tolerance of zero both members are equal.
struct Signs {
    unsigned surely_mixed;
    unsigned maybe_mixed;
};

template <class Lanes, typename Vector>
HWY_INLINE Signs signs(Lanes lanes, Vector lower, Vector upper, Vector tolerance)
{
    std::uint8_t bits[8];
    const auto to_bits = [&](auto mask) HWY_ATTR {
        return static_cast<unsigned>(hn::StoreMaskBits(lanes, mask, bits) == 1 ? bits[0] : bits[0] | bits[1] << 8);
    };
    const auto least = hn::Neg(tolerance);
    return {to_bits(hn::And(hn::Lt(lower, least), hn::Ge(upper, tolerance))),
            to_bits(hn::And(hn::Lt(lower, tolerance), hn::Ge(upper, least)))};
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
