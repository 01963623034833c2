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
