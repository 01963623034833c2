#include "catch.h"

#include "isospline/math/brent.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

using namespace isospline;

namespace {

struct Found {
    double root;
    int evaluations;
};

Found find_root(const std::function<double(double)>& f, double a, double b, double tolerance)
{
    int evaluations = 0;
    const auto counting = [&](double x) {
        ++evaluations;
        return f(x);
    };
    const double root = brent_root(counting, {a, f(a)}, {b, f(b)}, tolerance);
    return {root, evaluations};
}

} // namespace

TEST_CASE("Brent's method finds roots known in closed form", "[math]")
{
    struct Case {
        std::function<double(double)> f;
        double a, b, root;
    };
    const Case cases[] = {
        {[](double x) { return x * x - 2.0; }, 0.0, 2.0, std::sqrt(2.0)},
        {[](double x) { return x * x - 2.0; }, 2.0, 0.0, std::sqrt(2.0)},
        {[](double x) { return std::cos(x) - x; }, 0.0, 1.0, 0.73908513321516064},
        {[](double x) { return std::exp(x) - 5.0; }, -10.0, 10.0, std::log(5.0)},
        {[](double x) { return std::atan(x - 0.3); }, -1e3, 1e6, 0.3},
        {[](double x) { return (x - 1.0) * (1.0 + 1e-3 * x); }, -0.5, 1e2, 1.0},
        {[](double x) { return 1e-200 * (x - 0.25); }, 0.0, 1.0, 0.25},
        {[](double x) { return x < 0.7 ? -1.0 : 1.0; }, 0.0, 1.0, 0.7},
    };
    for (const Case& known : cases)
        for (const double tolerance : {1e-3, 1e-8, 1e-12}) {
            const Found found = find_root(known.f, known.a, known.b, tolerance);
            REQUIRE(std::abs(found.root - known.root) <= tolerance + 1e-15 * std::abs(known.root));
            REQUIRE(found.evaluations < 120);
        }
}

TEST_CASE("Brent's method takes few steps on a smooth function", "[math]")
{
    REQUIRE(find_root([](double x) { return std::cos(x) - x; }, 0.0, 1.0, 1e-12).evaluations <= 9);
    REQUIRE(find_root([](double x) { return 3.0 * x - 1.0; }, 0.0, 1.0, 1e-12).evaluations <= 3);
}

TEST_CASE("Brent's method stays robust at multiple roots", "[math]")
{
    // (x - 1/3)^9 is below the smallest step's rounding around its root: the sign still changes there.
    const Found found = find_root([](double x) { return std::pow(x - 1.0 / 3.0, 9.0); }, 0.0, 1.0, 1e-12);
    REQUIRE(found.root == Approx(1.0 / 3.0).margin(1e-9));
    REQUIRE(found.evaluations < 300);
}

TEST_CASE("Brent's method returns an end where the function is zero", "[math]")
{
    const auto f = [](double x) { return x * (x - 3.0); };
    REQUIRE(brent_root(f, {0.0, f(0.0)}, {1.0, f(1.0)}, 1e-12) == 0.0);
    REQUIRE(brent_root(f, {1.0, f(1.0)}, {3.0, f(3.0)}, 1e-12) == 3.0);
}

TEST_CASE("Brent's method ends within the tolerance of a change of sign", "[math]")
{
    std::mt19937 random(7);
    std::normal_distribution<double> coefficient;
    std::uniform_real_distribution<double> exponent(-14.0, -2.0);
    int solved = 0;
    while (solved < 5000) {
        const double a[] = {coefficient(random), coefficient(random), coefficient(random), coefficient(random)};
        const auto f = [&](double x) { return a[0] + x * (a[1] + x * (a[2] + x * a[3])); };
        if (f(0.0) * f(1.0) > 0.0)
            continue;
        const double tolerance = std::pow(10.0, exponent(random));
        const Found found = find_root(f, 0.0, 1.0, tolerance);
        const double reach = tolerance + 1e-15;
        REQUIRE(found.root >= 0.0);
        REQUIRE(found.root <= 1.0);
        REQUIRE(f(std::max(0.0, found.root - reach)) * f(std::min(1.0, found.root + reach)) <= 1e-30);
        ++solved;
    }
}
