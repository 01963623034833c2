// Roots of polynomials in Bernstein form. Included once for each SIMD target.
#include "isospline/math/bernstein.h"
#include "isospline/math/number-inl.h"

#include <cmath>

#if defined(ISOSPLINE_MATH_ROOTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_MATH_ROOTS_INL_H
#undef ISOSPLINE_MATH_ROOTS_INL_H
#else
#define ISOSPLINE_MATH_ROOTS_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// Coefficients of 1, s, s^2, ... of the same polynomial: the k-th forward difference of the b_i, times C(Order, k).
template <int Order, class N>
HWY_INLINE Bernstein<Order, N> to_monomial(Bernstein<Order, N> b)
{
    for (int k = 1; k <= Order; ++k)
        for (int i = Order; i >= k; --i)
            b[i] = b[i] - b[i - 1];
    for (int k = 1; k < Order; ++k)
        b[k] = b[k] * number<N>(binomials<Order>[k]);
    return b;
}

/// Where the control polygon of coefficients that change sign once crosses zero.
template <int Order, class N>
HWY_INLINE N crossing_of_control_polygon(const Bernstein<Order, N>& b)
{
    const N zero = number<N>(0.0);
    N before = b[0], after = b[1], first = zero;
    for (int i = 1; i < Order; ++i) {
        const auto crosses = differ(less(b[i], zero), less(b[i + 1], zero));
        before = select(crosses, b[i], before);
        after = select(crosses, b[i + 1], after);
        first = select(crosses, number<N>(i), first);
    }
    return (first + before / (before - after)) * number<N>(1.0 / Order);
}

/// Newton's method for the only root in [0, 1] of a polynomial whose Bernstein coefficients change sign once. It uses
/// the monomial form and a shrinking bracket, and starts where the control polygon crosses zero.
template <int Order, class N>
struct BracketedNewton {
    explicit HWY_INLINE BracketedNewton(const Bernstein<Order, N>& b)
        : monomial(to_monomial<Order>(b)), negative_at_0(less(b[0], number<N>(0.0))),
          s(crossing_of_control_polygon<Order>(b))
    {
    }

    struct ValueAndSlope {
        N value, slope;
    };

    HWY_INLINE ValueAndSlope evaluate() const
    {
        N value = monomial[Order], slope = number<N>(0.0);
        for (int k = Order - 1; k >= 0; --k) {
            slope = mul_add(slope, s, value);
            value = mul_add(value, s, monomial[k]);
        }
        return {value, slope};
    }

    struct Step {
        N newton;                ///< the result of a Newton step
        MaskOf<N> is_in_bracket; ///< otherwise s is now the middle of the bracket
    };

    HWY_INLINE Step step()
    {
        const auto [value, slope] = evaluate();
        const auto right_of_root = differ(less(value, number<N>(0.0)), negative_at_0);
        lower = select(right_of_root, lower, s);
        upper = select(right_of_root, s, upper);
        const N newton = s - value / slope;
        const auto is_in_bracket = both(less_equal(lower, newton), less_equal(newton, upper));
        s = select(is_in_bracket, newton, number<N>(0.5) * (lower + upper));
        return {newton, is_in_bracket};
    }

    Bernstein<Order, N> monomial;
    MaskOf<N> negative_at_0;
    N s, lower = number<N>(0.0), upper = number<N>(1.0);
};

/// The same root, in double precision.
template <int Order>
HWY_INLINE double isolated_root(const Bernstein<Order>& b)
{
    BracketedNewton<Order, double> search(b);
    constexpr int bisections_to_full_precision = 60;
    for (int iteration = 0; iteration < bisections_to_full_precision; ++iteration) {
        // Newton's method squares its error: after a step of 1e-8, the next would be below rounding.
        const double before = search.s;
        const auto [newton, is_in_bracket] = search.step();
        if (std::abs(newton - before) <= (is_in_bracket ? 1e-8 : 1e-15))
            return is_in_bracket ? newton : before;
    }
    return search.s;
}

/// The approximate root of a polynomial, and the derivative there.
template <class N>
struct RootEstimate {
    N s, slope;
};

/// The approximate root from scaled Bernstein coefficients, to start a search in double precision.
template <int Order, class N>
HWY_INLINE RootEstimate<N> estimate_root(const Bernstein<Order, N>& scaled)
{
    Bernstein<Order, N> b;
    for (int r = 0; r <= Order; ++r)
        b[r] = scaled[r] * number<N>(1.0 / binomials<Order>[r]);
    BracketedNewton<Order, N> search(b);
    search.step();
    search.step();
    return {search.s, search.evaluate().slope};
}

/// Calls `visit(s, rising)` for the s in [0, 1] where a polynomial in Bernstein form changes sign, in ascending order,
/// until it returns false; `rising` means that the sign becomes positive. Subdivides, left half first, until a piece
/// has no sign change (no root, by the convex hull property) or one (one root). A touching root leaves pieces too
/// narrow to be subdivided; these count as a crossing only if the signs at their ends differ.
template <int Order, typename Visit>
inline void for_each_root(const Bernstein<Order>& b, const Visit& visit)
{
    constexpr int depth_limit = 48;
    struct Piece {
        Bernstein<Order> b;
        double lower;
        int depth;
    };
    std::array<Piece, depth_limit + 1> stack;
    int size = 0;
    stack[size++] = {b, 0.0, 0};
    while (size > 0) {
        Piece piece = stack[--size];
        const double width = std::ldexp(1.0, -piece.depth);
        const int changes = sign_changes<Order>(piece.b);
        if (changes == 0)
            continue;
        const bool rising = piece.b[0] < 0.0;
        if (changes == 1) {
            if (!visit(piece.lower + width * isolated_root<Order>(piece.b), rising))
                return;
            continue;
        }
        if (piece.depth == depth_limit) {
            const bool ends_negative = piece.b[Order] < 0.0;
            if (rising != ends_negative && !visit(piece.lower + 0.5 * width, rising))
                return;
            continue;
        }
        Piece right{{}, piece.lower + 0.5 * width, piece.depth + 1};
        split_in_half<Order>(piece.b, piece.b, right.b);
        ++piece.depth;
        stack[size++] = right;
        stack[size++] = piece;
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
