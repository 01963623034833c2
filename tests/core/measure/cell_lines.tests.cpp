#include "isospline/measure/cell_lines.h"

#include "catch.h"

#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

using namespace isospline;

namespace {

constexpr int size = 24;

/// Coefficients whose spline is f(x) = 9^2 - |x - center|^2 on all cells, up to the rounding of float32.
class Ball {
public:
    explicit Ball(int degree) : degree_(degree)
    {
        const double variance = degree == 2 ? 0.25 : 1.0 / 3.0;
        for (int k = 0; k < size; ++k)
            for (int j = 0; j < size; ++j)
                for (int i = 0; i < size; ++i) {
                    const glm::dvec3 r = glm::dvec3(i, j, k) - glm::dvec3(11.3, 11.6, 11.9);
                    numbers_.push_back(static_cast<float>(81.0 - glm::dot(r, r) + 3.0 * variance));
                }
    }

    LineSums integrate(const QuadratureOptions& options, double level, double sign) const
    {
        const CellLines lines(degree_, options);
        LineSums sums;
        for (int k = 0; k < size - degree_; ++k)
            for (int j = 0; j < size - degree_; ++j)
                for (int i = 0; i < size - degree_; ++i) {
                    const float* const first = &numbers_[static_cast<std::size_t>(i + size * (j + size * k))];
                    REQUIRE(lines.add({CoefficientView{first, size, size * size}, level, glm::ivec3(0)}, sign, sums));
                }
        return sums;
    }

private:
    int degree_;
    std::vector<float> numbers_;
};

} // namespace

TEST_CASE("lines across all cells of an ellipsoid have its integrals", "[measure]")
{
    constexpr double pi = std::numbers::pi;
    const double volume = 4.0 / 3.0 * pi * 729.0, area = 4.0 * pi * 81.0, mean = 4.0 * pi * 9.0, gaussian = 4.0 * pi;
    for (const int degree : {2, 3}) {
        const Ball ball(degree);
        const double cells = std::pow(size - degree, 3);
        for (const double sign : {1.0, -1.0}) {
            for (const int order : {5, 9, 17}) {
                const LineSums sums = ball.integrate({order, true, true, glm::dmat3(2.0)}, 0.001, sign);
                const auto error = [&](std::size_t rule, Quantity quantity, double expected) {
                    return std::abs(sums.rules[rule][static_cast<std::size_t>(quantity)] / expected - 1.0);
                };
                const double inside = sign > 0.0 ? volume : cells - volume;
                CAPTURE(degree, sign, order);
                REQUIRE(error(0, Quantity::volume, 8.0 * inside) < 3e-5);
                REQUIRE(error(0, Quantity::area, 4.0 * area) < 2.0 * std::pow(order, -3.0));
                REQUIRE(error(0, Quantity::mean_curvature, sign * 2.0 * mean) < 2.0 * std::pow(order, -3.0));
                REQUIRE(error(0, Quantity::gaussian_curvature, gaussian) < 2.0 * std::pow(order, -3.0));
                // The coarser rules integrate the same, with larger errors.
                for (const std::size_t coarse : {1u, 2u})
                    REQUIRE(error(coarse, Quantity::area, 4.0 * area) < 0.1);
                REQUIRE(sums.magnitude[static_cast<std::size_t>(Quantity::area)] ==
                        Approx(sums.rules[0][static_cast<std::size_t>(Quantity::area)]));
                REQUIRE(sums.cells > 1000);
            }
        }
    }
}

TEST_CASE("lines leave a cell alone that has a coefficient at the level", "[measure]")
{
    const std::vector<float> numbers{-1, 1, -1, 1, 0, 1, -1, 1};
    LineSums sums;
    const CellCoefficients cell{CoefficientView{numbers.data(), 2, 4}, 0.0, glm::ivec3(0)};
    REQUIRE_FALSE(CellLines(1, {7}).add(cell, 1.0, sums));
    REQUIRE(sums.rules[0][0] == 0.0);
    REQUIRE(sums.cells == 0);
}

TEST_CASE("lines in SIMD lanes have the integrals of single lines", "[measure]")
{
    const int degree = GENERATE(1, 2);
    const int order = GENERATE(5, 7, 16, 21);
    std::mt19937 random(degree + order);
    std::uniform_real_distribution<float> number(-1.0f, 1.0f);
    const glm::dmat3 lattice_to_world(1.1, 0.2, 0.0, -0.1, 0.9, 0.3, 0.0, 0.1, 1.4);
    // With curvatures, lines are cut one by one.
    const CellLines in_lanes(degree, {order, true, false, lattice_to_world});
    const CellLines without_area(degree, {order, false, false, lattice_to_world});
    const CellLines one_by_one(degree, {order, true, true, lattice_to_world});
    LineSums found, volume, expected;
    for (int cell = 0; cell < 400; ++cell) {
        std::array<float, 27> numbers;
        for (float& each : numbers)
            each = number(random);
        const CellCoefficients coefficients(CoefficientView{numbers.data(), degree + 1, (degree + 1) * (degree + 1)},
                                            0.1, glm::ivec3(0));
        const double sign = cell % 2 == 0 ? 1.0 : -1.0;
        REQUIRE(in_lanes.add(coefficients, sign, found));
        REQUIRE(without_area.add(coefficients, sign, volume));
        REQUIRE(one_by_one.add(coefficients, sign, expected));
    }
    REQUIRE(found.cells == expected.cells);
    for (std::size_t rule = 0; rule < 3; ++rule) {
        REQUIRE(found.rules[rule][0] == Approx(expected.rules[rule][0]).epsilon(1e-11));
        REQUIRE(found.rules[rule][1] == Approx(expected.rules[rule][1]).epsilon(1e-9));
        REQUIRE(volume.rules[rule][0] == Approx(expected.rules[rule][0]).epsilon(1e-11));
        REQUIRE(volume.rules[rule][1] == 0.0);
    }
    REQUIRE(found.magnitude[1] == Approx(expected.magnitude[1]).epsilon(1e-9));
}
