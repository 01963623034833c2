// Signs of f along a straight segment in one cell, with a bound on the rounding error, and the search for the first
// change of sign along a line, segment by segment: docs/method.md, "Certified rays". Independent of the intersection in
// cell/, which it can check.
#pragma once

#include "isospline/math/bernstein.h"
#include "isospline/spline/coefficient_view.h"
#include "isospline/trace/certified_line.h"
#include "isospline/trace/certified_ray.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace isospline::certified {

/// A number is proven to have a sign if its computed value is beyond the bound of its error: 1 or -1, 0 if it is not.
inline int proven_sign(double value, double error)
{
    return value > error ? 1 : value < -error ? -1 : 0;
}

/// The weights of the n+1 coefficients in the polar form of a uniform spline on its cell [0, 1], by the algorithm of
/// de Boor with another argument in each step: the first `Degree - ends` are `start`, the others `end`. None is
/// negative, and each has a relative error below 15 u, u = 2^-53.
template <int Degree>
std::array<double, Degree + 1> polar_weights(double start, double end, int ends)
{
    constexpr std::array<double, 4> over{0.0, 1.0, 1.0 / 2.0, 1.0 / 3.0};
    std::array<double, Degree + 1> weights{1.0};
    for (int step = Degree; step >= 1; --step) {
        const double at = step > Degree - ends ? end : start;
        const int count = Degree - step + 1; // weights so far, and the length of their knot spans
        double carried = 0.0;
        for (int i = 0; i < count; ++i) {
            const double share = weights[static_cast<std::size_t>(i)] * over[static_cast<std::size_t>(count)];
            weights[static_cast<std::size_t>(i)] = carried + share * (1 + i - at);
            carried = share * (at - (1 + i - count));
        }
        weights[static_cast<std::size_t>(count)] = carried;
    }
    return weights;
}

/// f - threshold along the segment from `start` to `end`, which are local coordinates in [0, 1], as a polynomial in
/// Bernstein form. If no coefficient is farther than `magnitude` from the threshold, the errors of its coefficients,
/// and those of pieces of it, are below polynomial_error(magnitude).
template <int Degree>
Bernstein<3 * Degree> polynomial_along(const CoefficientView& cell, double threshold, const glm::dvec3& start,
                                       const glm::dvec3& end)
{
    constexpr std::size_t count = Degree + 1;
    using Row = std::array<double, count>;
    std::array<std::array<Row, count>, 3> weights; // by axis, number of arguments at the end, and coefficient
    for (int axis = 0; axis < 3; ++axis)
        for (std::size_t p = 0; p < count; ++p)
            weights[static_cast<std::size_t>(axis)][p] =
                polar_weights<Degree>(start[axis], end[axis], static_cast<int>(p));

    // The polar form at all numbers of arguments along x, y and z.
    std::array<std::array<Row, count>, count> form{};
    for (std::size_t k = 0; k < count; ++k) {
        std::array<Row, count> plane{};
        for (std::size_t j = 0; j < count; ++j) {
            const float* const from = cell.first + static_cast<std::ptrdiff_t>(j) * cell.row_stride +
                                      static_cast<std::ptrdiff_t>(k) * cell.slice_stride;
            Row line{};
            for (std::size_t i = 0; i < count; ++i)
                for (std::size_t p = 0; p < count; ++p)
                    line[p] += weights[0][p][i] * (static_cast<double>(from[i]) - threshold);
            for (std::size_t q = 0; q < count; ++q)
                for (std::size_t p = 0; p < count; ++p)
                    plane[q][p] += weights[1][q][j] * line[p];
        }
        for (std::size_t r = 0; r < count; ++r)
            for (std::size_t q = 0; q < count; ++q)
                for (std::size_t p = 0; p < count; ++p)
                    form[r][q][p] += weights[2][r][k] * plane[q][p];
    }

    // A Bernstein coefficient is the mean of the polar form over the ways to give its arguments to the axes.
    Bernstein<3 * Degree> b{};
    for (std::size_t r = 0; r < count; ++r)
        for (std::size_t q = 0; q < count; ++q)
            for (std::size_t p = 0; p < count; ++p)
                b[p + q + r] += binomials<Degree>[p] * binomials<Degree>[q] * binomials<Degree>[r] * form[r][q][p];
    for (std::size_t i = 0; i <= 3 * Degree; ++i)
        b[i] /= binomials<3 * Degree>[i];
    return b;
}

/// The bound of polynomial_along(): 256 u times the magnitude. It has room for 78 u of the coefficients, 54 u of two
/// subdivisions and 36 u of the rounded places where a polynomial is divided, and for underflow.
inline double polynomial_error(double magnitude)
{
    return 0x1p-45 * magnitude + 0x1p-900;
}

/// The polynomial on [0, s], and its value at s: de Casteljau's algorithm.
template <int D>
Bernstein<D> piece_before(Bernstein<D> b, double s)
{
    Bernstein<D> piece;
    for (std::size_t i = 0; i < D; ++i) {
        piece[i] = b[0];
        for (std::size_t j = 0; j < D - i; ++j)
            b[j] = (1.0 - s) * b[j] + s * b[j + 1];
    }
    piece[D] = b[0];
    return piece;
}

/// The polynomial on [from, to], from < to.
template <int D>
Bernstein<D> piece_between(const Bernstein<D>& b, double from, double to)
{
    Bernstein<D> piece = piece_before<D>(b, to);
    if (from == 0.0)
        return piece;
    std::reverse(piece.begin(), piece.end());
    piece = piece_before<D>(piece, (to - from) / to);
    std::reverse(piece.begin(), piece.end());
    return piece;
}

/// Whether a polynomial with these coefficients has the sign everywhere (convex hull).
template <int D>
bool has_sign(const Bernstein<D>& b, int sign, double error)
{
    bool all = true;
    for (const double each : b)
        all &= sign * each > error;
    return all;
}

/// Where a proven sign ends.
struct Reach {
    double to;   ///< the sign is proven on [0, to]
    double step; ///< the distance behind `to` at which the other sign may be proven
};

/// A root of a polynomial by Newton's method from a place near it; a guess that nothing relies on.
template <int D>
Reach guess_reach(const Bernstein<D>& b, double s, double error)
{
    for (int step = 0; step < 8; ++step) {
        Bernstein<D> level = b;
        for (std::size_t row = D; row > 1; --row)
            for (std::size_t j = 0; j < row; ++j)
                level[j] = (1.0 - s) * level[j] + s * level[j + 1];
        const double value = (1.0 - s) * level[0] + s * level[1], slope = D * (level[1] - level[0]);
        const double next = s - value / slope;
        if (!(next > 0.0 && next < 1.0))
            return {0.0, 0.0};
        const double moved = std::abs(next - s);
        s = next;
        if (moved < 0x1p-40) {
            const double margin = std::max(2.0 * error / std::abs(slope), 0x1p-46);
            return {s - margin, 2.0 * margin};
        }
    }
    return {0.0, 0.0};
}

/// Where the control polygon first crosses zero.
template <int D>
double first_crossing_of_polygon(const Bernstein<D>& b, int sign)
{
    std::size_t i = 1;
    while (i < D && sign * b[i] > 0.0)
        ++i;
    return (static_cast<double>(i) - 1.0 + std::clamp(b[i - 1] / (b[i - 1] - b[i]), 0.0, 1.0)) / D;
}

/// The part of [0, 1], from 0, on which a polynomial is proven to have the sign. A root may be near `hint`, which may
/// be any number.
template <int D>
Reach proven_reach(const Bernstein<D>& b, int sign, double error, double hint)
{
    constexpr double least_step = 0x1p-46;
    if (has_sign<D>(b, sign, error))
        return {1.0, least_step};
    if (!(sign * b[0] > error))
        return {0.0, least_step};
    const bool is_hinted = hint > 0.0 && hint < 1.0;
    const Reach guess = guess_reach<D>(b, is_hinted ? hint : first_crossing_of_polygon<D>(b, sign), error);
    if (guess.to > 0.0 && has_sign<D>(piece_before<D>(b, guess.to), sign, error))
        return guess;
    double to = 0.0;
    for (double step = 0.5; step >= least_step;) {
        const double end = std::min(to + step, 1.0);
        if (has_sign<D>(piece_between<D>(b, to, end), sign, error)) {
            to = end;
            if (to == 1.0)
                break;
            step *= 2.0;
        } else {
            step *= 0.5;
        }
    }
    return {to, least_step};
}

/// A place with a proven sign.
struct SignAt {
    double s;
    int sign; ///< 0 if none is proven
};

/// The first place found behind `reach` where a sign is proven.
template <int D>
SignAt next_sign(const Bernstein<D>& b, const Reach& reach, double error)
{
    for (double step = reach.step;; step *= 2.0) {
        const double s = std::min(reach.to + step, 1.0);
        const int sign = proven_sign(piece_before<D>(b, s)[D], error);
        if (sign != 0 || s == 1.0)
            return {s, sign};
    }
}

/// Takes the parts of a ray in order, each beginning where the one before ended, until the certificate is decided.
class Search {
public:
    /// The first crossing may be near `t_hint`; nothing relies on it.
    explicit Search(const Range& range, double t_hint = std::numeric_limits<double>::infinity())
        : range_(range), t_hint_(t_hint)
    {
    }

    bool is_decided() const { return decided_; }
    const RayCertificate& certificate() const { return certificate_; }
    /// The proven sign of f where the search began, or of the part before the first doubt; 0 if there is none.
    int sign() const { return sign_; }
    /// A t behind the first doubt at which a sign is proven; infinite if there is none.
    double t_resume() const { return t_resume_; }

    /// f has the sign, 1 or -1, from t_begin to t_end.
    void pass(double t_begin, int sign)
    {
        if (sign_ == 0 && !open_) {
            sign_ = sign;
        } else if (open_ || sign != sign_) {
            begin_to_doubt(t_begin); // which cannot be: the signs are proven
            decide(t_begin, sign);
        }
    }

    /// f - threshold is within `error` of a polynomial from t_begin to t_end, s = 0 to 1.
    template <int D>
    void pass(double t_begin, double t_end, const Bernstein<D>& b, double error)
    {
        const bool was_open = open_;
        Reach reach{0.0, 0x1p-46};
        if (!was_open) {
            if (sign_ == 0)
                sign_ = proven_sign(b[0], error);
            if (sign_ != 0)
                reach = proven_reach<D>(b, sign_, error, (t_hint_ - t_begin) / (t_end - t_begin));
            if (reach.to == 1.0)
                return;
        }
        // t of s: rounded outwards by more than its three roundings.
        const double margin = 0x1p-50 * (std::abs(t_begin) + std::abs(t_end));
        begin_to_doubt(std::max(t_begin + reach.to * (t_end - t_begin) - margin, t_begin));
        const SignAt next = next_sign<D>(b, reach, error);
        if (next.sign != 0)
            decide(std::min(t_begin + next.s * (t_end - t_begin) + margin, t_end), next.sign);
        else if (++parts_in_doubt_ == most_parts_in_doubt)
            decide(t_end, 0);
        if (!was_open && certificate_.status != RayStatus::hit)
            certificate_.level_bound = bound_at<D>(b, reach.to, error, 2.0 * margin / (t_end - t_begin));
    }

    /// Nothing is known of f from t_begin on.
    void give_up(double t_begin)
    {
        begin_to_doubt(t_begin);
        certificate_.level_bound = std::numeric_limits<double>::infinity();
        decide(t_begin, 0);
    }

    /// The ray ends.
    void end()
    {
        if (open_ && !decided_)
            decide(range_.end, 0);
    }

private:
    /// A surface that a line follows, within rounding, through more cells is not searched on.
    static constexpr int most_parts_in_doubt = 8;

    /// A bound on |f - level| up to `margin` before s. No derivative of a polynomial exceeds 2 D max |b|.
    template <int D>
    static double bound_at(const Bernstein<D>& b, double s, double error, double margin)
    {
        double most = 0.0;
        for (const double each : b)
            most = std::max(most, std::abs(each));
        const double bound = std::abs(piece_before<D>(b, s)[D]) + 2.0 * D * most * margin;
        return ((bound < most ? bound : most) + error) * (1.0 + 0x1p-40);
    }

    /// From t on, or from where doubt began before, the sign is not proven.
    void begin_to_doubt(double t)
    {
        if (open_)
            return;
        open_ = true;
        certificate_.t_lower = t;
    }

    /// f has the sign at t; 0 if no sign is proven.
    void decide(double t, int sign)
    {
        decided_ = true;
        if (sign != 0)
            t_resume_ = t;
        const bool inside = certificate_.t_lower >= range_.sure_begin && t <= range_.sure_end;
        if (sign_ * sign < 0 && inside) {
            certificate_.status = RayStatus::hit;
            certificate_.t_upper = t;
            certificate_.level_bound = 0.0;
        } else {
            certificate_.status = RayStatus::undecided;
        }
    }

    Range range_;
    double t_hint_;
    int sign_ = 0; ///< of f up to where doubt began; 0 at the beginning
    bool open_ = false, decided_ = false;
    int parts_in_doubt_ = 0;
    double t_resume_ = std::numeric_limits<double>::infinity();
    RayCertificate certificate_;
};

} // namespace isospline::certified
