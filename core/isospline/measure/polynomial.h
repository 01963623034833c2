// Polynomials of one and two variables in Bernstein form on [0, 1], with degrees chosen at run time.
#pragma once

#include "isospline/math/brent.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace isospline {

/// The largest degree along an axis, which a cubic cell has on an oblique plane.
inline constexpr int largest_polynomial_degree = 6;

/// The Bernstein polynomials of a degree at s; those beyond are 0.
template <int Most>
std::array<double, Most + 1> bernstein_values(double s, int degree = Most)
{
    std::array<double, Most + 1> values{1.0};
    for (int done = 1; done <= degree; ++done) {
        values[done] = s * values[done - 1];
        for (int i = done - 1; i > 0; --i)
            values[i] = s * values[i - 1] + (1.0 - s) * values[i];
        values[0] *= 1.0 - s;
    }
    return values;
}

/// Their derivatives.
template <int Degree>
std::array<double, Degree + 1> bernstein_slopes(double s)
{
    const auto lower = bernstein_values<Degree - 1>(s);
    std::array<double, Degree + 1> slopes{};
    for (int i = 0; i < Degree; ++i) {
        slopes[i] -= Degree * lower[i];
        slopes[i + 1] += Degree * lower[i];
    }
    return slopes;
}

/// A polynomial of one variable.
struct LinePolynomial {
    int degree = 0;
    std::array<double, largest_polynomial_degree + 1> b{};

    double value(double s) const
    {
        std::array<double, largest_polynomial_degree + 1> row = b;
        for (int left = degree; left > 0; --left)
            for (int i = 0; i < left; ++i)
                row[i] += s * (row[i + 1] - row[i]);
        return row[0];
    }

    double derivative(double s) const
    {
        LinePolynomial lower{degree - 1, {}};
        for (int i = 0; i < degree; ++i)
            lower.b[i] = degree * (b[i + 1] - b[i]);
        return lower.value(s);
    }

    /// The polynomial on [begin, end], reparametrised to [0, 1].
    LinePolynomial part(double begin, double end) const
    {
        LinePolynomial upper{degree, b};
        for (int left = degree; left > 0; --left) // the part above `begin`
            for (int i = 0; i < left; ++i)
                upper.b[i] += begin * (upper.b[i + 1] - upper.b[i]);
        LinePolynomial both{degree, upper.b};
        const double s = begin < 1.0 ? (end - begin) / (1.0 - begin) : 1.0;
        for (int done = 1; done <= degree; ++done)
            for (int i = degree; i >= done; --i)
                both.b[i] = both.b[i - 1] + s * (both.b[i] - both.b[i - 1]);
        return both;
    }
};

/// Whether coefficients have both signs; zero counts as positive.
template <typename Coefficients>
inline bool has_both_signs(const Coefficients& coefficients, std::size_t count)
{
    bool has_negative = false, has_positive = false;
    for (std::size_t i = 0; i < count; ++i) {
        has_negative |= coefficients[i] < 0.0;
        has_positive |= coefficients[i] >= 0.0;
    }
    return has_negative && has_positive;
}

/// The root of a quadratic polynomial whose values at the ends of [0, 1] have opposite signs.
///
/// With t = s / (1 - s), the polynomial is (1 - s)^2 (b0 + 2 b1 t + b2 t^2). Of the two roots t, one is positive. No
/// difference of numbers of one sign occurs, so all digits are right.
inline double quadratic_root(double b0, double b1, double b2)
{
    const double upwards = b2 > 0.0 ? 1.0 : -1.0;
    const double start = -upwards * b0, middle = upwards * b1, end = upwards * b2; // start and end are positive
    const double root = std::sqrt(middle * middle + start * end);
    return middle > 0.0 ? start / (root + middle + start) : (root - middle) / (root - middle + end);
}

/// A root between the ends of [0, 1], where the values have opposite signs or one is zero.
inline double bracketed_root(const LinePolynomial& p)
{
    if (const auto last = p.b[static_cast<std::size_t>(p.degree)]; p.b[0] == 0.0 || last == 0.0)
        return last == 0.0 ? 1.0 : 0.0;
    if (p.degree == 1)
        return p.b[0] / (p.b[0] - p.b[1]);
    if (p.degree == 2)
        return quadratic_root(p.b[0], p.b[1], p.b[2]);
    const FunctionPoint first{0.0, p.b[0]}, last{1.0, p.b[static_cast<std::size_t>(p.degree)]};
    return brent_root([&](double s) { return p.value(s); }, first, last, 1e-16);
}

/// Calls `visit(s)` for the roots in [0, 1] where the sign changes, in ascending order.
template <typename Visit>
void for_each_root(const LinePolynomial& p, const Visit& visit, double begin = 0.0, double end = 1.0)
{
    const auto count = static_cast<std::size_t>(p.degree) + 1;
    if (p.degree == 0 || !has_both_signs(p.b, count))
        return;
    int changes = 0;
    for (std::size_t i = 1; i < count; ++i)
        changes += (p.b[i] < 0.0) != (p.b[i - 1] < 0.0);
    if (changes == 1) {
        visit(begin + (end - begin) * bracketed_root(p));
        return;
    }
    if (end - begin < 1e-14)
        return;
    const double middle = 0.5 * (begin + end);
    for_each_root(p.part(0.0, 0.5), visit, begin, middle);
    for_each_root(p.part(0.5, 1.0), visit, middle, end);
}

/// A polynomial of two variables.
struct PatchPolynomial {
    std::array<int, 2> degree{};
    std::array<double, (largest_polynomial_degree + 1) * (largest_polynomial_degree + 1)> b{};

    std::size_t count() const { return static_cast<std::size_t>((degree[0] + 1) * (degree[1] + 1)); }
    double& item(int i, int j) { return b[static_cast<std::size_t>(i + (degree[0] + 1) * j)]; }
    double item(int i, int j) const { return b[static_cast<std::size_t>(i + (degree[0] + 1) * j)]; }
    bool has_zeros() const { return has_both_signs(b, count()); }
    bool is_zero() const
    {
        return std::all_of(b.begin(), b.begin() + static_cast<std::ptrdiff_t>(count()),
                           [](double x) { return x == 0.0; });
    }

    /// The coefficients along an axis, at one index of the other axis.
    LinePolynomial row(int axis, int at) const
    {
        LinePolynomial line{degree[axis], {}};
        for (int i = 0; i <= degree[axis]; ++i)
            line.b[i] = axis == 0 ? item(i, at) : item(at, i);
        return line;
    }

    /// The polynomial along an axis, where the other coordinate is s.
    LinePolynomial line(int axis, double s) const
    {
        const auto weights = bernstein_values<largest_polynomial_degree>(s, degree[1 - axis]);
        LinePolynomial line{degree[axis], {}};
        for (int i = 0; i <= degree[axis]; ++i)
            for (int at = 0; at <= degree[1 - axis]; ++at)
                line.b[i] += weights[at] * (axis == 0 ? item(i, at) : item(at, i));
        return line;
    }

    /// The polynomial on [begin, end] along an axis, reparametrised to the unit square.
    PatchPolynomial part(int axis, double begin, double end) const
    {
        PatchPolynomial result{degree, {}};
        for (int at = 0; at <= degree[1 - axis]; ++at) {
            const LinePolynomial line = row(axis, at).part(begin, end);
            for (int i = 0; i <= degree[axis]; ++i)
                (axis == 0 ? result.item(i, at) : result.item(at, i)) = line.b[i];
        }
        return result;
    }

    /// How well its zeros are a graph over the other axis: the smallest slope along this axis divided by the largest
    /// slope along any axis. It is at least 0 if the polynomial is monotonic along this axis.
    double graph_slope(int axis) const
    {
        double least[2] = {1e300, 1e300}, most[2] = {-1e300, -1e300};
        for (int along = 0; along < 2; ++along)
            for (int at = 0; at <= degree[1 - along]; ++at) {
                const LinePolynomial line = row(along, at);
                for (int i = 0; i < degree[along]; ++i) {
                    const double slope = degree[along] * (line.b[i + 1] - line.b[i]);
                    least[along] = std::min(least[along], slope);
                    most[along] = std::max(most[along], slope);
                }
            }
        const double steepest = std::max(std::max(most[0], -least[0]), std::max(most[1], -least[1]));
        return std::max(least[axis], -most[axis]) / steepest;
    }
};

} // namespace isospline
