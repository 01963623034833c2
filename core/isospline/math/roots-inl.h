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
template <int Order>
HWY_INLINE Bernstein<Order> to_monomial(Bernstein<Order> b)
{
    for (int k = 1; k <= Order; ++k)
        for (int i = Order; i >= k; --i)
            b[i] -= b[i - 1];
    for (int k = 1; k < Order; ++k)
        b[k] *= binomials<Order>[k];
    return b;
}

/// Where the control polygon of coefficients that change sign once crosses zero.
template <int Order>
HWY_INLINE double crossing_of_control_polygon(const Bernstein<Order>& b)
{
    int first = 0;
    for (int i = 1; i < Order; ++i)
        if ((b[i] < 0.0) != (b[i + 1] < 0.0))
            first = i;
    return (first + b[first] / (b[first] - b[first + 1])) * (1.0 / Order);
}

/// Newton's method for the only root in [0, 1] of a polynomial whose Bernstein coefficients change sign once. It uses
/// the monomial form and a shrinking bracket, and starts where the control polygon crosses zero.
template <int Order>
struct BracketedNewton {
    explicit HWY_INLINE BracketedNewton(const Bernstein<Order>& b)
        : monomial(to_monomial<Order>(b)), negative_at_0(b[0] < 0.0), s(crossing_of_control_polygon<Order>(b))
    {
    }

    struct Step {
        double newton;      ///< the result of a Newton step
        bool is_in_bracket; ///< otherwise s is now the middle of the bracket
    };

    HWY_INLINE Step step()
    {
        double value = monomial[Order], slope = 0.0;
        for (int k = Order - 1; k >= 0; --k) {
            slope = slope * s + value;
            value = value * s + monomial[k];
        }
        const bool right_of_root = (value < 0.0) != negative_at_0;
        (right_of_root ? upper : lower) = s;
        const double newton = s - value / slope;
        const bool is_in_bracket = lower <= newton && newton <= upper;
        s = is_in_bracket ? newton : 0.5 * (lower + upper);
        return {newton, is_in_bracket};
    }

    Bernstein<Order> monomial;
    bool negative_at_0;
    double s, lower = 0.0, upper = 1.0;
};

/// The root.
template <int Order>
HWY_INLINE double isolated_root(const Bernstein<Order>& b)
{
    BracketedNewton<Order> search(b);
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
