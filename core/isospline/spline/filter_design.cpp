#include "isospline/spline/filter_design.h"

#include "isospline/spline/basis.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numeric>

namespace isospline {

namespace {

/// Coefficients of a polynomial, lowest power first. Symmetric Laurent polynomials in z are written as polynomials in
/// v = 2 - z - 1/z = |1 - z|^2. In this form the difference operator is exact for constants, where v = 0.
using Polynomial = std::vector<double>;

Polynomial operator*(const Polynomial& a, const Polynomial& b)
{
    Polynomial product(a.size() + b.size() - 1, 0.0);
    for (std::size_t i = 0; i < a.size(); ++i)
        for (std::size_t j = 0; j < b.size(); ++j)
            product[i + j] += a[i] * b[j];
    return product;
}

Polynomial operator+(Polynomial a, const Polynomial& b)
{
    a.resize(std::max(a.size(), b.size()), 0.0);
    for (std::size_t i = 0; i < b.size(); ++i)
        a[i] += b[i];
    return a;
}

/// beta^n at 0, 1, ..., as far as it is not zero.
std::vector<double> sampled_bspline(int degree)
{
    std::vector<double> taps;
    for (int k = 0; k <= degree / 2; ++k)
        taps.push_back(bspline(degree, k).value);
    return taps;
}

/// taps[0] + sum of taps[k] p_k with p_k = z^k + z^-k, by the recursion p_(k+1) = p_1 p_k - p_(k-1).
Polynomial laurent(const std::vector<double>& taps)
{
    const Polynomial z_plus_inverse{2.0, -1.0};
    Polynomial previous{2.0};
    Polynomial current = z_plus_inverse;
    Polynomial sum{taps[0]};
    for (std::size_t k = 1; k < taps.size(); ++k) {
        sum = sum + Polynomial{taps[k]} * current;
        const Polynomial next = z_plus_inverse * current + Polynomial{-1.0} * previous;
        previous = current;
        current = next;
    }
    return sum;
}

Polynomial sampled_bspline_polynomial(int degree)
{
    return degree < 0 ? Polynomial{1.0} : laurent(sampled_bspline(degree));
}

/// All roots, smallest first: Laguerre's method starts at zero, and each root is divided out.
std::vector<std::complex<double>> roots_of(const Polynomial& polynomial)
{
    using Complex = std::complex<double>;
    std::vector<Complex> remaining(polynomial.begin(), polynomial.end());
    std::vector<Complex> roots;
    while (remaining.size() > 1) {
        const auto degree = static_cast<double>(remaining.size() - 1);
        Complex root = 0.0;
        for (int iteration = 0; iteration < 100; ++iteration) {
            Complex value = 0.0, first = 0.0, half_second = 0.0;
            for (std::size_t i = remaining.size(); i-- > 0;) {
                half_second = half_second * root + first;
                first = first * root + value;
                value = value * root + remaining[i];
            }
            if (value == 0.0)
                break;
            const Complex slope = first / value;
            const Complex curvature = slope * slope - 2.0 * half_second / value;
            const Complex radical = std::sqrt((degree - 1.0) * (degree * curvature - slope * slope));
            const Complex denominator =
                std::abs(slope + radical) > std::abs(slope - radical) ? slope + radical : slope - radical;
            const Complex step = degree / denominator;
            root -= step;
            if (std::abs(step) <= 1e-16 * std::abs(root))
                break;
        }
        roots.push_back(root);
        // Synthetic division by (v - root).
        for (std::size_t i = remaining.size() - 1; i-- > 0;)
            remaining[i] += root * remaining[i + 1];
        remaining.erase(remaining.begin());
    }
    return roots;
}

/// The solution of z + 1/z = 2 - v inside of the unit circle.
std::complex<double> pole_of(const std::complex<double>& v)
{
    const auto half_sum = 1.0 - 0.5 * v;
    const auto half_difference = std::sqrt(0.25 * v * v - v);
    const auto a = half_sum + half_difference;
    const auto b = half_sum - half_difference;
    return 1.0 / (std::abs(a) > std::abs(b) ? a : b);
}

} // namespace

RecursiveFilter design_filter(int degree, Filter filter, double smoothing)
{
    // The denominator and the numerator.
    RecursiveFilter result;
    Polynomial divisor{1.0};
    const bool smooth = filter == Filter::smoothing && smoothing > 0.0;
    if (filter != Filter::none)
        divisor = sampled_bspline_polynomial(degree);
    if (smooth) {
        const int order = degree / 2 + 1;
        Polynomial roughness(static_cast<std::size_t>(order) + 1, 0.0);
        roughness.back() = smoothing;
        if (degree % 2 == 0) {
            divisor = divisor * divisor;
            roughness = roughness * sampled_bspline_polynomial(2 * (degree - order) + 1);
            if (degree > 0)
                result.numerator = sampled_bspline(degree);
        }
        divisor = divisor + roughness;
    }

    // Its spectral factor A(z), the product of (1 - z_i / z) over the poles inside of the unit circle.
    std::vector<std::complex<double>> factor{1.0};
    for (const auto& root : roots_of(divisor)) {
        const auto pole = pole_of(root);
        result.largest_pole = std::max(result.largest_pole, std::abs(pole));
        factor.push_back(0.0);
        for (std::size_t i = factor.size() - 1; i > 0; --i)
            factor[i] -= pole * factor[i - 1];
    }
    double at_one = 1.0;
    for (std::size_t i = 1; i < factor.size(); ++i) {
        result.feedback.push_back(-factor[i].real());
        at_one += factor[i].real();
    }
    result.gain = at_one * at_one;
    return result;
}

double filter_horizon(const RecursiveFilter& filter, double forgotten)
{
    if (!(filter.largest_pole > 0.0))
        return 0.0;
    const double steps = std::ceil(std::log(forgotten) / std::log(filter.largest_pole));
    return filter.feedback.size() > 1 ? 2.0 * steps : steps;
}

FilterNorm norm_of(const RecursiveFilter& filter)
{
    const auto steps = static_cast<long long>(filter_horizon(filter, 0x1p-60));
    std::vector<double> last(filter.feedback.size(), 0.0); // of the response, latest first
    double recursion = 1.0, next = 1.0;
    for (long long step = 0; step < steps; ++step) {
        if (!last.empty()) {
            std::rotate(last.begin(), last.end() - 1, last.end());
            last.front() = next;
        }
        next = std::inner_product(last.begin(), last.end(), filter.feedback.begin(), 0.0);
        recursion += std::abs(next);
    }
    double taps = filter.numerator.empty() ? 1.0 : std::abs(filter.numerator[0]);
    for (std::size_t k = 1; k < filter.numerator.size(); ++k)
        taps += 2.0 * std::abs(filter.numerator[k]);
    return {recursion, filter.gain * taps * recursion * recursion};
}

int filter_reach(const RecursiveFilter& filter)
{
    const auto reach = filter.numerator.empty() ? 0.0 : static_cast<double>(filter.numerator.size() - 1);
    return static_cast<int>(filter_horizon(filter, 0x1p-40) + reach);
}

} // namespace isospline
