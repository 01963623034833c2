#include "catch.h"

#include "isospline/measure/gauss_legendre.h"

#include <cmath>

using namespace isospline;

TEST_CASE("Gauss-Legendre rules are exact for polynomials up to their degree", "[measure]")
{
    for (int count = 1; count <= 10; ++count)
        for (int power = 0; power < 2 * count; ++power) {
            double sum = 0.0;
            for (const QuadratureNode& node : gauss_legendre(count))
                sum += node.weight * std::pow(node.position, power);
            CHECK(std::abs(sum - 1.0 / (power + 1)) < 1e-14);
        }
}
