// Roots of polynomials in Bernstein form.
#pragma once

#include "isospline/math/bernstein.h"

#include <cmath>
#include <optional>

namespace isospline {

/// The root in [0, 1] of a polynomial whose Bernstein coefficients change sign once, and so has exactly one there:
/// Newton's method on the monomial form, kept inside a shrinking bracket.
template <int Degree>
inline double isolated_root(const Bernstein<Degree>& b)
{
    // Start where the control polygon crosses zero.
    const bool negative_at_0 = b[0] < 0.0;
    int i = 0;
    while ((b[i + 1] < 0.0) == negative_at_0)
        ++i;
    double s = (i + b[i] / (b[i] - b[i + 1])) / Degree;

    const std::array<double, Degree + 1> a = to_monomial<Degree>(b);
    double lower = 0.0, upper = 1.0;
    constexpr int bisections_to_full_precision = 60;
    for (int iteration = 0; iteration < bisections_to_full_precision; ++iteration) {
        double value = a[Degree], slope = 0.0;
        for (int k = Degree - 1; k >= 0; --k) {
            slope = slope * s + value;
            value = value * s + a[k];
        }
        ((value < 0.0) == negative_at_0 ? lower : upper) = s;

        // Newton's method squares its error: after a step of 1e-8 the next would be below rounding. Where it leaves the
        // bracket, the bracket is halved instead.
        const double newton = s - value / slope;
        const bool inside = newton > lower && newton < upper;
        if (std::abs(newton - s) <= (inside ? 1e-8 : 1e-15))
            return inside ? newton : s;
        s = inside ? newton : 0.5 * (lower + upper);
    }
    return s;
}

/// Calls `visit(s, rising)` for the s in [0, 1] where a polynomial in Bernstein form changes sign, in ascending order,
/// until it returns false; `rising` tells that the sign becomes positive. Subdivides, left half first, until a piece
/// has no sign change (no root, by the convex hull) or one (one root); pieces narrower than rounding can tell apart,
/// which only a touching root leaves, count as a crossing only if the signs at their ends differ.
template <int Degree, typename Visit>
inline void for_each_root(const Bernstein<Degree>& b, const Visit& visit)
{
    constexpr int depth_limit = 48;
    struct Piece {
        Bernstein<Degree> b;
        double lower;
        int depth;
    };
    switch (sign_changes<Degree>(b)) {
    case 0:
        return;
    case 1:
        visit(isolated_root<Degree>(b), b[0] < 0.0);
        return;
    }

    std::array<Piece, depth_limit + 1> stack;
    int size = 0;
    stack[size++] = {b, 0.0, 0};
    while (size > 0) {
        Piece piece = stack[--size];
        const double width = std::ldexp(1.0, -piece.depth);
        const int changes = sign_changes<Degree>(piece.b);
        if (changes == 0)
            continue;
        const bool rising = piece.b[0] < 0.0;
        if (changes == 1) {
            if (!visit(piece.lower + width * isolated_root<Degree>(piece.b), rising))
                return;
            continue;
        }
        if (piece.depth == depth_limit) {
            const bool ends_negative = piece.b[Degree] < 0.0;
            if (rising != ends_negative && !visit(piece.lower + 0.5 * width, rising))
                return;
            continue;
        }
        Piece right{{}, piece.lower + 0.5 * width, piece.depth + 1};
        split_in_half<Degree>(piece.b, piece.b, right.b);
        ++piece.depth;
        stack[size++] = right;
        stack[size++] = piece;
    }
}

/// The first s in [0, 1] where a polynomial in Bernstein form changes sign, or nothing.
template <int Degree>
inline std::optional<double> first_root(const Bernstein<Degree>& b)
{
    std::optional<double> first;
    for_each_root<Degree>(b, [&](double s, bool) {
        first = s;
        return false;
    });
    return first;
}

} // namespace isospline
