#include "catch.h"

#include "isospline/math/roots-inl.h"

#include <algorithm>
#include <optional>
#include <random>
#include <vector>

using isospline::Bernstein;

namespace {

/// Bernstein coefficients on [0, 1] of scale * product of (s - root): each factor multiplies by -root (1 - s) + (1 -
/// root) s.
template <int Degree>
Bernstein<Degree> from_roots(const std::vector<double>& roots, double scale)
{
    std::vector<double> b{scale};
    for (const double root : roots) {
        // Product of Bernstein forms of degrees d and 1.
        const int d = static_cast<int>(b.size()) - 1;
        std::vector<double> next(b.size() + 1, 0.0);
        for (int i = 0; i <= d; ++i) {
            next[i] += b[i] * -root * (d + 1 - i) / (d + 1);
            next[i + 1] += b[i] * (1.0 - root) * (i + 1) / (d + 1);
        }
        b = next;
    }
    Bernstein<Degree> result;
    std::copy(b.begin(), b.end(), result.begin());
    return result;
}

template <int Degree>
double evaluate(Bernstein<Degree> b, double s)
{
    for (int level = Degree; level > 0; --level)
        for (int i = 0; i < level; ++i)
            b[i] = (1.0 - s) * b[i] + s * b[i + 1];
    return b[0];
}

template <int Degree>
std::optional<double> first_root(const Bernstein<Degree>& b)
{
    std::optional<double> first;
    isospline::scalar::for_each_root<Degree>(b, [&](double s, bool) {
        first = s;
        return false;
    });
    return first;
}

template <int Degree>
void check_random_roots(unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> anywhere(-1.0, 2.0), scale_exponent(-12.0, 12.0);
    for (int repetition = 0; repetition < 20000; ++repetition) {
        std::vector<double> roots(Degree);
        for (double& root : roots)
            root = anywhere(random);
        std::sort(roots.begin(), roots.end());
        const auto b = from_roots<Degree>(roots, std::pow(10.0, scale_exponent(random)));
        const std::optional<double> found = first_root<Degree>(b);
        const auto first = std::find_if(roots.begin(), roots.end(), [](double root) { return root >= 0.0; });
        if (first == roots.end() || *first > 1.0) {
            REQUIRE_FALSE(found);
            continue;
        }
        REQUIRE(found);
        // Roots close together are ill-conditioned by as much as they are close.
        double slope = 1.0;
        for (const double& root : roots)
            if (&root != &*first)
                slope *= std::abs(root - *first);
        if (slope > 1e-5)
            REQUIRE(*found == Approx(*first).margin(1e-7));
    }
}

} // namespace

TEST_CASE("to_monomial and split_in_half describe the same polynomial", "[math]")
{
    const Bernstein<3> b{1.0, -2.0, 5.0, 0.5};
    const auto a = isospline::scalar::to_monomial<3>(b);
    Bernstein<3> left, right;
    isospline::split_in_half<3>(b, left, right);
    for (double s = 0.0; s <= 1.0; s += 0.125) {
        const double expected = evaluate<3>(b, s);
        REQUIRE(a[0] + s * (a[1] + s * (a[2] + s * a[3])) == Approx(expected).margin(1e-13));
        REQUIRE((s < 0.5 ? evaluate<3>(left, 2.0 * s) : evaluate<3>(right, 2.0 * s - 1.0)) ==
                Approx(expected).margin(1e-13));
    }
}

TEST_CASE("first_root finds the first of random roots", "[math]")
{
    check_random_roots<3>(1);
    check_random_roots<6>(2);
    check_random_roots<9>(3);
}

TEST_CASE("first_root on hostile input", "[math]")
{
    // Two roots 1e-6 apart; a root at each end; a double root, which only touches and so may be taken for a crossing or
    // not; all zero; constants.
    REQUIRE(*first_root<3>(from_roots<3>({0.3, 0.300001, 5.0}, 1.0)) == Approx(0.3).margin(1e-8));
    REQUIRE(*first_root<3>(from_roots<3>({0.0, 3.0, 4.0}, -1.0)) == Approx(0.0).margin(1e-14));
    REQUIRE(*first_root<3>(from_roots<3>({1.0, 3.0, 4.0}, 1.0)) == Approx(1.0).margin(1e-14));
    REQUIRE_FALSE(first_root<3>({1.0, 0.0, 0.0, 1.0}));
    const auto touch = first_root<3>(from_roots<3>({0.3, 0.3, -1.0}, 1.0));
    REQUIRE((!touch || *touch == Approx(0.3).margin(1e-6)));
    REQUIRE_FALSE(first_root<6>(Bernstein<6>{}));
    REQUIRE_FALSE(first_root<6>({1, 1, 1, 1, 1, 1, 1}));
    REQUIRE_FALSE(first_root<6>({-1, -1, -1, -1, -1, -1, -1}));
    // A triple root is a crossing.
    REQUIRE(*first_root<9>(from_roots<9>({0.4, 0.4, 0.4, 2, 3, 4, 5, 6, 7}, 1.0)) == Approx(0.4).margin(1e-4));
    // Very steep and very flat polynomials.
    REQUIRE(*first_root<3>({-1e-300, -1e-300, -1e-300, 1e-300}) > 0.5);
    REQUIRE(*first_root<3>({-1e300, 1e-300, 1e-300, 1e300}) > 0.0);
}
