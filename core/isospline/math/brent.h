// Brent's root finder: Richard P. Brent, Algorithms for Minimization Without Derivatives, Prentice-Hall, 1973,
// chapter 4.
#pragma once

#include <cmath>
#include <limits>

namespace isospline {

/// A point of a function's graph.
struct FunctionPoint {
    double x;
    double value;
};

/// A root of `f` between two points where its values have opposite signs, or one is zero. The result is within
/// `tolerance` + 4 eps |root| of a change of sign.
///
/// Inverse quadratic interpolation, the secant if only two points are known, and bisection if these would leave the
/// bracket or do not shrink it fast enough.
template <typename Function>
double brent_root(const Function& f, FunctionPoint first, FunctionPoint second, double tolerance)
{
    // `best` is the estimate, `opposite` the other end of the bracket, `previous` the estimate before.
    FunctionPoint best = second, previous = first, opposite = first;
    double step = best.x - previous.x, previous_step = step;
    while (true) {
        if (std::abs(opposite.value) < std::abs(best.value)) {
            previous = best;
            best = opposite;
            opposite = previous;
        }
        const double smallest_step = 2.0 * std::numeric_limits<double>::epsilon() * std::abs(best.x) + 0.5 * tolerance;
        const double to_middle = 0.5 * (opposite.x - best.x);
        if (best.value == 0.0 || std::abs(to_middle) <= smallest_step)
            return best.x;

        // The interpolated step is p / q.
        double p = 0.0, q = 0.0;
        const bool converging =
            std::abs(previous_step) >= smallest_step && std::abs(previous.value) > std::abs(best.value);
        if (converging) {
            const double s = best.value / previous.value;
            if (previous.x == opposite.x) {
                p = 2.0 * to_middle * s;
                q = 1.0 - s;
            } else {
                const double r = best.value / opposite.value;
                const double u = previous.value / opposite.value;
                p = s * (2.0 * to_middle * u * (u - r) - (best.x - previous.x) * (r - 1.0));
                q = (u - 1.0) * (r - 1.0) * (s - 1.0);
            }
            if (p > 0.0)
                q = -q;
            p = std::abs(p);
        }

        // Take it if it stays within three quarters of the bracket and is less than half the step before last.
        const double before_last = previous_step;
        previous_step = step;
        if (converging && 2.0 * p < 3.0 * to_middle * q - std::abs(smallest_step * q) &&
            p < std::abs(0.5 * before_last * q))
            step = p / q;
        else
            step = previous_step = to_middle;

        previous = best;
        best.x += std::abs(step) > smallest_step ? step : std::copysign(smallest_step, to_middle);
        best.value = f(best.x);
        if ((best.value > 0.0) == (opposite.value > 0.0)) {
            opposite = previous;
            step = previous_step = best.x - previous.x;
        }
    }
}

} // namespace isospline
