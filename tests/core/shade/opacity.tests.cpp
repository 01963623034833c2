#include "catch.h"

#include "isospline/shade/shading.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

using namespace isospline;

namespace {

template <typename Model>
Model translucent(double opacity, double silhouette_opacity, double silhouette_exponent)
{
    Model model;
    model.opacity = opacity;
    model.silhouette_opacity = silhouette_opacity;
    model.silhouette_exponent = silhouette_exponent;
    return model;
}

/// A point whose normal and direction to the viewer have the angle.
SurfacePoint point_seen_at(double radians)
{
    SurfacePoint point;
    point.normal = {0.0, 0.0, 1.0};
    point.to_viewer = {std::sin(radians), 0.0, std::cos(radians)};
    return point;
}

} // namespace

TEMPLATE_TEST_CASE("opacity grows to that of the silhouette as Kay and Greenberg have it", "[shade]", Phong, Outline,
                   AmbientOcclusion)
{
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform;
    for (int trial = 0; trial < 1000; ++trial) {
        const double facing = uniform(random), silhouette = uniform(random), exponent = 0.1 + 10.0 * uniform(random);
        const double angle = 3.14159265358979 * uniform(random);
        const Shading shading = translucent<TestType>(facing, silhouette, exponent);
        // In the paper's terms: transparency between t_min, at the silhouette, and t_max.
        const double t_min = 1.0 - silhouette, t_max = 1.0 - facing;
        const double t = t_min + (t_max - t_min) * (1.0 - std::pow(1.0 - std::abs(std::cos(angle)), exponent));
        REQUIRE(opacity(shading, point_seen_at(angle)) == Approx(1.0 - t).margin(1e-12));
        REQUIRE_FALSE(even_opacity(shading));
    }
}

TEST_CASE("opacity has the given values at both ends, and is always within 0 to 1", "[shade]")
{
    for (const double exponent : {0.5, 1.0, 3.0, 2000.0}) {
        REQUIRE(opacity_at(0.25, 0.75, exponent, 1.0) == 0.25);
        REQUIRE(opacity_at(0.25, 0.75, exponent, -1.0) == 0.25);
        REQUIRE(opacity_at(0.25, 0.75, exponent, 0.0) == 0.75);
        REQUIRE(opacity_at(0.0, 1.0, exponent, 0.0) == 1.0);
        // As rounding may have it.
        REQUIRE(opacity_at(0.25, 0.75, exponent, 1.0 + 1e-15) == 0.25);
        REQUIRE(opacity_at(0.0, 1.0, exponent, -1.0 - 1e-15) == 0.0);
    }
}

TEST_CASE("without a silhouette opacity, opacity is the same everywhere", "[shade]")
{
    Phong phong;
    phong.opacity = 0.3;
    REQUIRE(even_opacity(phong) == 0.3);
    REQUIRE(opacity(phong, point_seen_at(1.5)) == 0.3);
    phong.silhouette_opacity = 0.3;
    REQUIRE(even_opacity(phong) == 0.3);
    REQUIRE(even_opacity(Outline()) == 1.0);
}

TEMPLATE_TEST_CASE("opacities that make no sense are refused by name", "[shade]", Phong, Outline, AmbientOcclusion)
{
    const auto message = [](const TestType& model) -> std::string {
        try {
            validate(model);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "";
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    REQUIRE(message(translucent<TestType>(0.3, 1.0, 2.0)).empty());
    for (const double wrong : {-0.1, 1.1, nan})
        REQUIRE(message(translucent<TestType>(0.3, wrong, 2.0)).find("silhouette_opacity: expected a number from 0") ==
                0);
    for (const double wrong : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()})
        REQUIRE(message(translucent<TestType>(0.3, 1.0, wrong)).find("silhouette_exponent: expected a finite number") ==
                0);
}
