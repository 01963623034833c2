// A cell's coefficients less the threshold, copied together. Included once for each SIMD target.
#include "isospline/cell/coefficients.h"
#include "isospline/math/number-inl.h"

#include <cmath>
#include <type_traits>

#if defined(ISOSPLINE_CELL_REDUCED_COEFFICIENTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_REDUCED_COEFFICIENTS_INL_H
#undef ISOSPLINE_CELL_REDUCED_COEFFICIENTS_INL_H
#else
#define ISOSPLINE_CELL_REDUCED_COEFFICIENTS_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

// A bound on the rounding error of the Bernstein coefficients of f - level along any segment in a cell, in single
// precision, from the largest magnitude of the cell's coefficients less the threshold; docs/method.md derives it.
template <int Degree, class V>
HWY_INLINE V rounding_error_of_bernstein(V magnitude, double threshold)
{
    constexpr float unit_roundoff = 0x1p-24f;
    constexpr float units = Degree <= 2 ? 33.0f : 77.0f, units_of_threshold = 1.01f;
    const V of_threshold = number<V>(units_of_threshold * std::abs(static_cast<float>(threshold)));
    return number<V>(unit_roundoff) * mul_add(number<V>(units), magnitude, of_threshold);
}

// The distance of rows in the copy, for every degree.
constexpr int local_row = 4;

template <int Degree, typename Real>
struct ReducedCoefficients {
    explicit HWY_INLINE ReducedCoefficients(const CellCoefficients& cell)
    {
        if constexpr (std::is_same_v<Real, float>)
            copy_in_single_precision(cell);
        else
            for (int k = 0; k <= Degree; ++k)
                for (int j = 0; j <= Degree; ++j)
                    for (int i = 0; i <= Degree; ++i)
                        values[index(i, j, k)] = cell(i, j, k);
    }

    HWY_INLINE Real operator()(int i, int j, int k) const { return values[index(i, j, k)]; }
    /// Aligned for vectors of a whole row; numbers behind the n+1 coefficients are zero in single precision.
    HWY_INLINE const Real* row(int j, int k) const { return values + index(0, j, k); }

    /// rounding_error_of_bernstein() of single precision.
    HWY_INLINE Real error() const { return error_; }

private:
    static constexpr int index(int i, int j, int k) { return (k * (Degree + 1) + j) * local_row + i; }

    HWY_INLINE void copy_in_single_precision(const CellCoefficients& cell)
    {
        const hn::CappedTag<float, local_row> d;
        constexpr int lanes = static_cast<int>(hn::MaxLanes(d));
        const auto threshold = hn::Set(d, static_cast<float>(cell.threshold));
        auto magnitudes = hn::Zero(d);
        for (int k = 0; k <= Degree; ++k)
            for (int j = 0; j <= Degree; ++j)
                for (int i = 0; i <= Degree; i += lanes) {
                    const auto used = hn::FirstN(d, static_cast<std::size_t>(Degree + 1 - i));
                    const auto reduced = hn::IfThenElseZero(used, hn::Sub(hn::LoadU(d, cell.row(j, k) + i), threshold));
                    hn::Store(reduced, d, values + index(i, j, k));
                    magnitudes = hn::Max(magnitudes, hn::Abs(reduced));
                }
        error_ = hn::GetLane(rounding_error_of_bernstein<Degree>(hn::MaxOfLanes(d, magnitudes), cell.threshold));
    }

    alignas(64) Real values[(Degree + 1) * (Degree + 1) * local_row];
    Real error_ = 0;
};

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
