#include "catch.h"

#include "isospline/measure/polynomial.h"

#include <cmath>
#include <random>
#include <vector>

using namespace isospline;

TEST_CASE("a part of a polynomial has the same values", "[measure]")
{
    std::mt19937 random(1);
    std::uniform_real_distribution<double> number(-1.0, 1.0), fraction(0.0, 1.0);
    for (int trial = 0; trial < 200; ++trial) {
        LinePolynomial p{trial % 7, {}};
        for (double& b : p.b)
            b = number(random);
        const double begin = 0.9 * fraction(random), end = begin + (1.0 - begin) * fraction(random);
        const double s = fraction(random);
        CHECK(std::abs(p.part(begin, end).value(s) - p.value(begin + s * (end - begin))) < 1e-13);
    }
}

TEST_CASE("a bracketed root is that of the factors", "[measure]")
{
    std::mt19937 random(3);
    std::uniform_real_distribution<double> power(-12.0, 0.0), fraction(0.0, 1.0);
    for (int trial = 0; trial < 1000; ++trial) {
        // (s - root) (s - other) times a factor, with the other root outside of [0, 1], near to it or far away.
        double root = std::pow(10.0, power(random));
        if (trial % 4 >= 2)
            root = 1.0 - root;
        const double distance = std::pow(10.0, -power(random) - 6.0), factor = trial % 3 == 0 ? -1e-3 : 40.0;
        const double other = trial % 2 == 0 ? -distance : 1.0 + distance;
        const LinePolynomial p{2,
                               {factor * root * other, 0.5 * factor * (2.0 * root * other - root - other),
                                factor * (1.0 - root) * (1.0 - other)}};
        CAPTURE(root, other);
        // Coefficients that are rounded move the root by this much.
        const double slope = std::abs(factor * (root - other));
        const double moved = 1e-15 * std::abs(factor) * (std::abs(root * other) + root + std::abs(other)) / slope;
        if ((p.b[0] < 0.0) != (p.b[2] < 0.0))
            REQUIRE(std::abs(bracketed_root(p) - root) <= moved + 1e-15);
    }
    REQUIRE(bracketed_root({1, {-1.0, 3.0}}) == 0.25);
    REQUIRE(bracketed_root({2, {0.0, -1.0, 1.0}}) == 0.0);
    REQUIRE(bracketed_root({2, {-1.0, -1.0, 0.0}}) == 1.0);
    REQUIRE(bracketed_root({2, {1.0, 0.0, -1.0}}) == 0.5); // (1 - s)^2 - s^2
}

TEST_CASE("all changes of sign of a polynomial are found", "[measure]")
{
    std::mt19937 random(2);
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    for (int trial = 0; trial < 500; ++trial) {
        LinePolynomial p{1 + trial % 6, {}};
        for (double& b : p.b)
            b = number(random);
        std::vector<double> roots;
        for_each_root(p, [&](double s) { roots.push_back(s); });
        for (std::size_t i = 0; i < roots.size(); ++i) {
            CHECK(std::abs(p.value(roots[i])) < 1e-13);
            CHECK((i == 0 || roots[i - 1] <= roots[i]));
        }
        // Between neighbouring points of a fine grid.
        std::size_t changes = 0;
        for (int i = 0; i < 2000; ++i)
            changes += (p.value(i / 2000.0) < 0.0) != (p.value((i + 1) / 2000.0) < 0.0);
        CHECK(roots.size() >= changes);
        CHECK((roots.size() - changes) % 2 == 0);
    }
}
