// What Bernstein coefficients prove of the roots of a polynomial, given their rounding error. Included once for each
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

/// Of scaled Bernstein coefficients, each of which is off by at most `error` times its binomial. With one sign all
/// along there is no root. With one sign, then at most one coefficient that may have either, then the other sign to the
/// end, there is exactly one (Descartes' rule of signs).
template <int Order, class N>
HWY_INLINE Verdict<N> judge(const Bernstein<Order, N>& scaled, float error)
{
    const N zero = number<N>(0.0);
    const auto flip = less(scaled[0], zero);
    auto in_first = less(number<N>(error), select(flip, negated(scaled[0]), scaled[0]));
    auto in_doubt = less(zero, zero), in_other = in_doubt; // nowhere yet
    for (int r = 1; r <= Order; ++r) {
        const N bound = number<N>(error * static_cast<float>(binomials<Order>[r]));
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
