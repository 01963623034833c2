#include "catch.h"

#include "isospline/spline/curvature.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <random>

using namespace isospline;

namespace {

glm::dvec3 random_vector(std::mt19937& random)
{
    std::normal_distribution<double> normal;
    return {normal(random), normal(random), normal(random)};
}

} // namespace

TEST_CASE("curvatures are the trace and the determinant of the Hessian in the tangent plane", "[spline]")
{
    std::mt19937 random(3);
    for (int trial = 0; trial < 1000; ++trial) {
        const glm::dvec3 gradient = std::exp2(trial % 60 - 30) * random_vector(random);
        const glm::dvec3 a = random_vector(random), b = random_vector(random);
        const glm::dmat3 hessian(a.x, a.y, a.z, a.y, b.x, b.y, a.z, b.y, b.z);

        // The second fundamental form in a basis (u, v) of the plane.
        const glm::dvec3 n = glm::normalize(gradient);
        const glm::dvec3 u = glm::normalize(glm::cross(n, random_vector(random)));
        const glm::dvec3 v = glm::cross(n, u);
        const double scale = 1.0 / glm::length(gradient);
        const double uu = scale * glm::dot(u, hessian * u), uv = scale * glm::dot(u, hessian * v),
                     vv = scale * glm::dot(v, hessian * v);

        const Curvature curvature = curvature_of_level_surface(gradient, hessian);
        REQUIRE(curvature.mean == Approx(0.5 * (uu + vv)).margin(1e-12 * scale));
        REQUIRE(curvature.gaussian == Approx(uu * vv - uv * uv).margin(1e-12 * scale * scale));
        REQUIRE(curvature.maximum() + curvature.minimum() == Approx(uu + vv).margin(1e-12 * scale));
        REQUIRE(curvature.maximum() - curvature.minimum() == Approx(std::hypot(uu - vv, 2.0 * uv)).epsilon(1e-6));
    }
}

TEST_CASE("a ball bends away from its outward normal, and a point without a gradient has no curvature", "[spline]")
{
    const glm::dvec3 position(1.0, -2.0, 2.0); // f = |x|^2
    const Curvature curvature = curvature_of_level_surface(2.0 * position, glm::dmat3(2.0));
    REQUIRE(curvature.mean == Approx(1.0 / 3.0));
    REQUIRE(curvature.gaussian == Approx(1.0 / 9.0));
    REQUIRE(curvature.maximum() == Approx(1.0 / 3.0));
    REQUIRE(curvature.minimum() == Approx(1.0 / 3.0));
    REQUIRE(curvature_of_level_surface({}, glm::dmat3(2.0)).mean == 0.0);
}
