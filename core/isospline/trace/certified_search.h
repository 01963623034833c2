// The search for the first change of sign along a line, part by part.
#pragma once

#include "isospline/trace/certified_line.h"
#include "isospline/trace/certified_polynomial.h"
#include "isospline/trace/certified_ray.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace isospline::certified {

/// Takes the parts of a ray in order, each beginning where the one before ended, until the certificate is decided.
class Search {
public:
    explicit Search(const Range& range) : range_(range) {}

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
            begin_to_doubt(t_begin);
            decide(t_begin, sign);
        }
    }

    /// f - threshold is within `error` of a polynomial from t_begin to t_end, s = 0 to 1.
    template <int D>
    void pass(double t_begin, double t_end, const Bernstein<D>& b, double error)
    {
        Reach reach{0.0, 0x1p-46};
        if (!open_) {
            if (sign_ == 0)
                sign_ = proven_sign(b[0], error);
            if (sign_ != 0)
                reach = proven_reach<D>(b, sign_, error);
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
    }

    /// Nothing is known of f from t_begin on.
    void give_up(double t_begin)
    {
        begin_to_doubt(t_begin);
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
        } else {
            certificate_.status = RayStatus::undecided;
        }
    }

    Range range_;
    int sign_ = 0; ///< of f up to where doubt began; 0 at the beginning
    bool open_ = false, decided_ = false;
    int parts_in_doubt_ = 0;
    double t_resume_ = std::numeric_limits<double>::infinity();
    RayCertificate certificate_;
};

} // namespace isospline::certified
