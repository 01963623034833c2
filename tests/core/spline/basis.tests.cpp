#include "catch.h"

#include "isospline/spline/basis.h"
#include "isospline/spline/cell_weights-inl.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

using namespace isospline;

namespace {

/// beta^n as the (n+1)-th difference of the one-sided power: the definition, for n >= 1.
double bspline_by_definition(int degree, double x)
{
    double sum = 0.0, binomial = 1.0, factorial = 1.0;
    for (int i = 1; i <= degree; ++i)
        factorial *= i;
    for (int i = 0; i <= degree + 1; ++i) {
        const double y = x + 0.5 * (degree + 1) - i;
        sum += (i % 2 == 0 ? binomial : -binomial) * (y > 0.0 ? std::pow(y, degree) : 0.0);
        binomial = binomial * (degree + 1 - i) / (i + 1);
    }
    return sum / factorial;
}

template <int Degree>
double spline_value(const std::vector<double>& coefficients, double lattice)
{
    const auto cell = static_cast<std::size_t>(std::floor(lattice));
    const auto weights = scalar::cell_weights<Degree>(lattice - std::floor(lattice));
    double sum = 0.0;
    for (std::size_t j = 0; j <= Degree; ++j)
        sum += weights[j] * coefficients[cell + j];
    return sum;
}

template <int Degree>
void check_two_scale_relation()
{
    std::mt19937 random(2);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    constexpr int cells = 4;
    std::vector<double> coarse(cells + Degree), fine(2 * cells + Degree, 0.0);
    for (double& coefficient : coarse)
        coefficient = unit(random);
    const auto weights = two_scale_weights<Degree, double>();
    for (int m = 0; m < static_cast<int>(fine.size()); ++m)
        for (int j = 0; j < static_cast<int>(coarse.size()); ++j)
            if (const int i = m + Degree - 2 * j; i >= 0 && i <= Degree + 1)
                fine[static_cast<std::size_t>(m)] +=
                    coarse[static_cast<std::size_t>(j)] * weights[static_cast<std::size_t>(i)];
    for (int trial = 0; trial < 50; ++trial) {
        const double lattice = cells * unit(random);
        REQUIRE(spline_value<Degree>(fine, 2.0 * lattice) ==
                Approx(spline_value<Degree>(coarse, lattice)).epsilon(1e-13));
    }
}

} // namespace

TEST_CASE("the recursion gives the B-splines of their definition and their derivatives", "[spline]")
{
    for (int degree = 1; degree <= 7; ++degree)
        for (double x = -4.51; x < 4.6; x += 0.093) {
            const double h = 1e-5;
            const double slope =
                (bspline_by_definition(degree, x + h) - bspline_by_definition(degree, x - h)) / (2.0 * h);
            REQUIRE(bspline(degree, x).value == Approx(bspline_by_definition(degree, x)).margin(1e-11));
            REQUIRE(bspline(degree, x).derivative == Approx(slope).margin(2e-6));
        }
}

TEST_CASE("B-splines of every degree sum to one", "[spline]")
{
    for (int degree = 0; degree <= 7; ++degree)
        for (double x = -0.47; x < 0.5; x += 0.0613) {
            double sum = 0.0, slope = 0.0;
            for (int k = -5; k <= 5; ++k) {
                sum += bspline(degree, x - k).value;
                slope += bspline(degree, x - k).derivative;
            }
            REQUIRE(sum == Approx(1.0).epsilon(1e-13));
            REQUIRE(slope == Approx(0.0).margin(1e-13));
        }
}

TEST_CASE("coefficients of half the spacing give the same spline", "[spline]")
{
    check_two_scale_relation<0>();
    check_two_scale_relation<1>();
    check_two_scale_relation<2>();
    check_two_scale_relation<3>();
    check_two_scale_relation<4>();
    check_two_scale_relation<5>();
}
