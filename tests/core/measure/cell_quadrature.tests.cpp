#include "isospline/measure/cell_quadrature.h"

#include "catch.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <span>
#include <vector>

using namespace isospline;

namespace {

using std::numbers::pi;

/// A cell alone, whose coefficients are those of a polynomial of up to the cell's degree in each coordinate. For
/// quadratic polynomials the B-spline coefficients are samples less half of the B-spline's variance times the second
/// derivatives; a linear one has its samples.
struct CellAlone {
    /// f(x) = a + <b, x> - c |x - center|^2 in local coordinates.
    CellAlone(int degree, double a, const glm::dvec3& b, double c = 0.0, const glm::dvec3& center = glm::dvec3(0.0))
        : count(degree + 1)
    {
        const double variance = degree == 2 ? 0.25 : degree == 3 ? 1.0 / 3.0 : 0.0;
        const double first = degree == 2 ? -0.5 : degree == 3 ? -1.0 : 0.0; // place of the first sample
        for (int k = 0; k < count; ++k)
            for (int j = 0; j < count; ++j)
                for (int i = 0; i < count; ++i) {
                    const glm::dvec3 x = glm::dvec3(i, j, k) + first;
                    const glm::dvec3 r = x - center;
                    numbers.push_back(static_cast<float>(a + glm::dot(b, x) - c * (glm::dot(r, r) - 3.0 * variance)));
                }
    }

    CellCoefficients coefficients() const
    {
        return {CoefficientView{numbers.data(), count, static_cast<std::ptrdiff_t>(count) * count}, 0.0, glm::ivec3(0)};
    }

    int count;
    std::vector<float> numbers;
};

double value(const Integrals& integrals, Quantity quantity)
{
    return integrals.value[static_cast<std::size_t>(quantity)];
}

double error(const Integrals& integrals, Quantity quantity)
{
    return integrals.error[static_cast<std::size_t>(quantity)];
}

} // namespace

TEST_CASE("a plane through a cell has its volume and area", "[measure]")
{
    for (const int degree : {1, 2, 3}) {
        CellQuadrature quadrature(degree, {});
        // x > 1/4
        const Integrals across = quadrature.integrate(CellAlone(degree, -0.25, {1, 0, 0}).coefficients(), 1.0, {});
        REQUIRE(value(across, Quantity::volume) == Approx(0.75).epsilon(1e-12));
        REQUIRE(value(across, Quantity::area) == Approx(1.0).epsilon(1e-12));
        // and the other side of it
        const Integrals below = quadrature.integrate(CellAlone(degree, -0.25, {1, 0, 0}).coefficients(), -1.0, {});
        REQUIRE(value(below, Quantity::volume) == Approx(0.25).epsilon(1e-12));
        // x + y + z < 1/2: a corner
        const Integrals corner = quadrature.integrate(CellAlone(degree, 0.5, {-1, -1, -1}).coefficients(), 1.0, {});
        REQUIRE(value(corner, Quantity::volume) == Approx(1.0 / 48.0).epsilon(1e-9));
        REQUIRE(value(corner, Quantity::area) == Approx(std::sqrt(3.0) / 8.0).epsilon(1e-9));
        // x + y + z < 3/2: a hexagon
        const Integrals hexagon = quadrature.integrate(CellAlone(degree, 1.5, {-1, -1, -1}).coefficients(), 1.0, {});
        REQUIRE(value(hexagon, Quantity::volume) == Approx(0.5).epsilon(1e-9));
        REQUIRE(value(hexagon, Quantity::area) == Approx(0.75 * std::sqrt(3.0)).epsilon(1e-9));
        for (const Quantity quantity : {Quantity::volume, Quantity::area})
            REQUIRE(error(hexagon, quantity) < 1e-9);
    }
}

TEST_CASE("a cell inside of the solid counts completely, and a cell outside does not count", "[measure]")
{
    CellQuadrature quadrature(2, {});
    const CellAlone cell(2, 5.0, {1, 1, 1});
    REQUIRE(value(quadrature.integrate(cell.coefficients(), 1.0, {}), Quantity::volume) == 1.0);
    REQUIRE(value(quadrature.integrate(cell.coefficients(), 1.0, {}), Quantity::area) == 0.0);
    REQUIRE(value(quadrature.integrate(cell.coefficients(), -1.0, {}), Quantity::volume) == 0.0);
}

TEST_CASE("a ball in a cell has the integrals of a ball, more exactly for higher orders", "[measure]")
{
    for (const int degree : {2, 3}) {
        const double radius = 0.375;
        const CellAlone ball(degree, radius * radius, glm::dvec3(0.0), 1.0, glm::dvec3(0.5));
        const double exact[] = {4.0 / 3.0 * pi * std::pow(radius, 3), 4.0 * pi * radius * radius, 4.0 * pi * radius,
                                4.0 * pi};
        double before = 1.0;
        for (const int order : {2, 4, 6, 8}) {
            CellQuadrature quadrature(degree, {.order = order, .curvature = true});
            const Integrals found = quadrature.integrate(ball.coefficients(), 1.0, {});
            double worst = 0.0;
            for (std::size_t i = 0; i < quantity_count; ++i) {
                const double off = std::abs(found.value[i] - exact[i]);
                // float32 coefficients put the ball's radius off by some 1e-8
                REQUIRE(off <= found.error[i] + 1e-6 * exact[i]);
                worst = std::max(worst, off / exact[i]);
            }
            REQUIRE(worst < std::max(0.5 * before, 2e-6));
            before = worst;
        }
        REQUIRE(before < 2e-6);
    }
}

TEST_CASE("half-spaces keep a part of a ball, and caps close it", "[measure]")
{
    const double radius = 0.375;
    const CellAlone ball(2, radius * radius, glm::dvec3(0.0), 1.0, glm::dvec3(0.5));
    CellQuadrature quadrature(2, {.order = 8});
    const glm::dvec3 normal = glm::normalize(glm::dvec3(1.0, -2.0, 0.5));
    for (const double height : {0.0, 0.1, -0.2}) {
        const HalfSpace cut{normal, glm::dot(normal, glm::dvec3(0.5)) + height};
        const double cap = radius - height; // of the part that is left
        const Integrals left = quadrature.integrate(ball.coefficients(), 1.0, {&cut, 1});
        REQUIRE(value(left, Quantity::volume) == Approx(pi * cap * cap * (3.0 * radius - cap) / 3.0).epsilon(1e-5));
        REQUIRE(value(left, Quantity::area) == Approx(2.0 * pi * radius * cap).epsilon(1e-5));
        const Integrals disc = quadrature.integrate_cap(ball.coefficients(), 1.0, {&cut, 1}, 0);
        REQUIRE(value(disc, Quantity::area) == Approx(pi * (radius * radius - height * height)).epsilon(1e-5));
    }
    // A wedge of two planes through the centre, a quarter turn apart, leaves a quarter, and half a disc for each.
    const std::vector<HalfSpace> wedge{{{1, 0, 0}, 0.5}, {{0, 1, 0}, 0.5}};
    REQUIRE(value(quadrature.integrate(ball.coefficients(), 1.0, wedge), Quantity::volume) ==
            Approx(pi * std::pow(radius, 3) / 3.0).epsilon(1e-5));
    for (const std::size_t plane : {0, 1})
        REQUIRE(value(quadrature.integrate_cap(ball.coefficients(), 1.0, wedge, plane), Quantity::area) ==
                Approx(0.5 * pi * radius * radius).epsilon(1e-5));
}

TEST_CASE("an affine map scales volumes by its determinant, and areas by their directions", "[measure]")
{
    const glm::dmat3 map(2.0, 0.3, 0.0, 0.0, -0.5, 0.1, 0.4, 0.0, 3.0);
    CellQuadrature quadrature(2, {.order = 8, .lattice_to_world = map});
    const CellAlone ball(2, 0.140625, glm::dvec3(0.0), 1.0, glm::dvec3(0.5));
    REQUIRE(value(quadrature.integrate(ball.coefficients(), 1.0, {}), Quantity::volume) ==
            Approx(std::abs(glm::determinant(map)) * 4.0 / 3.0 * pi * std::pow(0.375, 3)).epsilon(1e-5));
    // A plane across z is the parallelogram of the images of x and y.
    const CellAlone plane(2, -0.5, {0, 0, 1});
    REQUIRE(value(quadrature.integrate(plane.coefficients(), 1.0, {}), Quantity::area) ==
            Approx(glm::length(glm::cross(map[0], map[1]))).epsilon(1e-12));
}

TEST_CASE("zero counts as above the level", "[measure]")
{
    const std::vector<HalfSpace> upper_part{{{0.0, 1.0, 0.0}, 0.25}};
    for (const int degree : {1, 2, 3}) {
        CellQuadrature quadrature(degree, {});
        const auto require = [&](double slope, double sign, double volume, double area) {
            for (const bool is_cut : {false, true}) {
                const Integrals found = quadrature.integrate(CellAlone(degree, 0.0, {slope, 0, 0}).coefficients(), sign,
                                                             is_cut ? std::span<const HalfSpace>(upper_part)
                                                                    : std::span<const HalfSpace>());
                REQUIRE(value(found, Quantity::volume) == Approx(is_cut ? 0.75 * volume : volume).margin(1e-12));
                REQUIRE(value(found, Quantity::area) == Approx(is_cut ? 0.75 * area : area).margin(1e-12));
            }
        };
        // f = x, -x and 0 on the cell: only the second has f < 0, and so the face x = 0 as its border.
        require(1.0, 1.0, 1.0, 0.0);
        require(1.0, -1.0, 0.0, 0.0);
        require(-1.0, 1.0, 0.0, 1.0);
        require(-1.0, -1.0, 1.0, 1.0);
        require(0.0, 1.0, 1.0, 0.0);
        require(0.0, -1.0, 0.0, 0.0);
    }
}
