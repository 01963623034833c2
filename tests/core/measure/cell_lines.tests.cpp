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
        CellLines lines(degree_, options);
        LineSums sums;
        for (int k = 0; k < size - degree_; ++k)
            for (int j = 0; j < size - degree_; ++j)
                for (int i = 0; i < size - degree_; ++i) {
                    const float* const first = &numbers_[static_cast<std::size_t>(i + size * (j + size * k))];
                    REQUIRE(lines.add({CoefficientView{first, size, size * size}, level, glm::ivec3(0)}, {i, j, k},
                                      sign, sums));
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
    const double level = 0.001, radius = std::sqrt(81.0 - level), gaussian = 4.0 * pi;
    const double volume = 4.0 / 3.0 * pi * std::pow(radius, 3.0), area = 4.0 * pi * radius * radius,
                 mean = 4.0 * pi * radius;
    for (const int degree : {2, 3}) {
        const Ball ball(degree);
        const double cells = std::pow(size - degree, 3);
        for (const double sign : {1.0, -1.0}) {
            for (const int order : {4, 8, 16}) {
                const LineSums sums = ball.integrate({order, true, true, glm::dmat3(2.0)}, level, sign);
                const auto error = [&](Quantity quantity, double expected) {
                    return std::abs(sums.value[index_of(quantity)] / expected - 1.0);
                };
                const double inside = sign > 0.0 ? volume : cells - volume;
                CAPTURE(degree, sign, order);
                REQUIRE(error(Quantity::volume, 8.0 * inside) < 0.002 * std::pow(order, -2.0));
                REQUIRE(error(Quantity::area, 4.0 * area) < 0.1 * std::pow(order, -2.0));
                REQUIRE(error(Quantity::mean_curvature, sign * 2.0 * mean) < 0.1 * std::pow(order, -2.0));
                REQUIRE(error(Quantity::gaussian_curvature, gaussian) < 0.1 * std::pow(order, -2.0));
                REQUIRE(sums.magnitude[index_of(Quantity::area)] == Approx(sums.value[index_of(Quantity::area)]));
                REQUIRE(sums.cells > 1000);
            }
        }
    }
}

TEST_CASE("lines have no error that all cells have in common, and deviations are those of their errors", "[measure]")
{
    // The same part of a surface in all cells: what their errors have in common does not cancel.
    const int degree = GENERATE(1, 2);
    const auto quantity = GENERATE(Quantity::volume, Quantity::area);
    const auto at = index_of(quantity);
    const QuadratureOptions options{8, quantity == Quantity::area, false, glm::dmat3(1.0)};
    CellLines lines(degree, options);
    for (const float height : {0.02f, 0.1f, 0.3f}) {
        std::array<float, 27> numbers; // a corner, or a small closed surface
        numbers.fill(-1.0f);
        numbers[static_cast<std::size_t>(degree == 1 ? 0 : 13)] = degree == 1 ? height : 1.37f + height;
        const CellCoefficients cell(CoefficientView{numbers.data(), degree + 1, (degree + 1) * (degree + 1)}, 0.0,
                                    glm::ivec3(0));
        const double expected =
            CellQuadrature(degree, {10, true, false, glm::dmat3(1.0)}).integrate(cell, 1.0, {}).value[at];
        // Groups of 64 columns along each axis, of which all have the same cell once.
        constexpr int groups = 400;
        double sum_of_errors = 0.0, squares = 0.0, variances = 0.0;
        for (int group = 0; group < groups; ++group) {
            LineSums found;
            for (int j = 0; j < 8; ++j)
                for (int i = 0; i < 8; ++i)
                    REQUIRE(lines.add(cell, 8 * group + glm::ivec3(i, j, (i + j) % 8), 1.0, found));
            const double error = found.value[at] - 64.0 * expected;
            sum_of_errors += error;
            squares += error * error;
            for (const LineSums::Column& column : found.columns)
                variances += column.deviation[at] * column.deviation[at];
        }
        CAPTURE(degree, at, height, expected, sum_of_errors, squares, variances);
        REQUIRE(expected > 0.0);
        REQUIRE(std::abs(sum_of_errors) < 4.0 * std::sqrt(squares) + 2.5e-7 * 64 * groups * expected);
        REQUIRE(squares == Approx(variances).epsilon(0.35));
    }
}

TEST_CASE("lines leave a cell alone that has a coefficient at the level", "[measure]")
{
    const std::vector<float> numbers{-1, 1, -1, 1, 0, 1, -1, 1};
    LineSums sums;
    const CellCoefficients cell{CoefficientView{numbers.data(), 2, 4}, 0.0, glm::ivec3(0)};
    REQUIRE_FALSE(CellLines(1, {8}).add(cell, glm::ivec3(0), 1.0, sums));
    REQUIRE(sums.value[0] == 0.0);
    REQUIRE(sums.cells == 0);
}

TEST_CASE("lines in SIMD lanes have the integrals of single lines", "[measure]")
{
    const int degree = GENERATE(1, 2);
    const int order = GENERATE(4, 8, 12, 32);
    std::mt19937 random(degree + order);
    std::uniform_real_distribution<float> number(-1.0f, 1.0f);
    const glm::dmat3 lattice_to_world(1.1, 0.2, 0.0, -0.1, 0.9, 0.3, 0.0, 0.1, 1.4);
    // With curvatures, lines are cut one by one.
    CellLines in_lanes(degree, {order, true, false, lattice_to_world});
    CellLines without_area(degree, {order, false, false, lattice_to_world});
    CellLines one_by_one(degree, {order, true, true, lattice_to_world});
    LineSums found, volume, expected;
    for (int cell = 0; cell < 400; ++cell) {
        std::array<float, 27> numbers;
        for (float& each : numbers)
            each = number(random);
        const CellCoefficients coefficients(CoefficientView{numbers.data(), degree + 1, (degree + 1) * (degree + 1)},
                                            0.1, glm::ivec3(0));
        const double sign = cell % 2 == 0 ? 1.0 : -1.0;
        REQUIRE(in_lanes.add(coefficients, {cell, 3 * cell, 7 * cell}, sign, found));
        REQUIRE(without_area.add(coefficients, {cell, 3 * cell, 7 * cell}, sign, volume));
        REQUIRE(one_by_one.add(coefficients, {cell, 3 * cell, 7 * cell}, sign, expected));
    }
    REQUIRE(found.cells == expected.cells);
    // In lanes, numbers are in single precision.
    REQUIRE(found.value[0] == Approx(expected.value[0]).epsilon(1e-7));
    REQUIRE(found.value[1] == Approx(expected.value[1]).epsilon(1e-6));
    REQUIRE(volume.value[0] == found.value[0]);
    REQUIRE(volume.value[1] == 0.0);
    REQUIRE(found.magnitude[1] == Approx(expected.magnitude[1]).epsilon(1e-6));
    for (std::size_t column = 0; column < LineSums::column_count; ++column) {
        REQUIRE(found.columns[column].deviation[0] ==
                Approx(expected.columns[column].deviation[0]).margin(1e-6 * expected.value[0]));
        REQUIRE(found.columns[column].deviation[1] ==
                Approx(expected.columns[column].deviation[1]).margin(1e-6 * expected.value[1]));
        REQUIRE(expected.columns[column].deviation[1] != 0.0);
    }
}

TEST_CASE("tiny coefficients keep their sign along lines", "[measure]")
{
    // A plane that crosses the cell at a distance of about 1e-45 from its lower face.
    std::vector<float> numbers{-1e-45f, 1, -1e-45f, 1, -1e-45f, 1, -1e-45f, 1};
    const CellCoefficients cell{CoefficientView{numbers.data(), 2, 4}, 0.0, glm::ivec3(0)};
    LineSums sums;
    REQUIRE(CellLines(1, {8}).add(cell, glm::ivec3(0), 1.0, sums));
    REQUIRE(sums.value[1] == Approx(1.0));
    REQUIRE(sums.value[0] == Approx(1.0));
}
