// What Bernstein coefficients prove about the roots of a polynomial, given their rounding error. Included once for each
// SIMD target.
#include "isospline/math/bernstein.h"
#include "isospline/math/number-inl.h"

#if defined(ISOSPLINE_CELL_VERDICT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_VERDICT_INL_H
#undef ISOSPLINE_CELL_VERDICT_INL_H
#else
#define ISOSPLINE_CELL_VERDICT_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// Where both are false, nothing is proven.
template <class N>
struct Verdict {
    MaskOf<N> no_root, one_root;
};

/// The verdict for scaled Bernstein coefficients, each with an error of at most `error` times its binomial. If all have
/// the same sign, there is no root. If one sign is followed by at most one coefficient of unknown sign, and then by the
/// other sign up to the end, there is exactly one root (Descartes' rule of signs).
template <int Order, class N>
HWY_INLINE Verdict<N> judge(const Bernstein<Order, N>& scaled, N error)
{
    const N zero = number<N>(0.0);
    const auto flip = less(scaled[0], zero);
    auto in_first = less(error, select(flip, negated(scaled[0]), scaled[0]));
    auto in_doubt = less(zero, zero), in_other = in_doubt; // nowhere yet
    for (int r = 1; r <= Order; ++r) {
        const N bound = error * number<N>(binomials<Order>[r]);
        const N value = select(flip, negated(scaled[r]), scaled[r]);
        const auto same = less(bound, value), other = less(value, negated(bound));
        in_other = both(either(in_first, either(in_doubt, in_other)), other);
        in_doubt = without(in_first, either(same, other));
        in_first = both(in_first, same);
    }
    return {in_first, in_other};
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
