#include "catch.h"

#include "isospline/shade/shading.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace isospline;

namespace {

glm::dvec3 random_direction(std::mt19937& random)
{
    std::normal_distribution<double> normal;
    return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
}

double clamped(double value)
{
    return value > 0.0 ? value : 0.0;
}

void require_equal_up_to_rounding(const glm::dvec3& a, const glm::dvec3& b)
{
    for (int channel = 0; channel < 3; ++channel)
        REQUIRE(a[channel] == Approx(b[channel]).margin(1e-12));
}

} // namespace

TEST_CASE("Phong is the paper's sum over coloured lights of both kinds", "[shade]")
{
    std::mt19937 random(1);
    for (int trial = 0; trial < 1000; ++trial) {
        const glm::dvec3 at = 3.0 * random_direction(random);
        const glm::dvec3 n = random_direction(random);
        const glm::dvec3 v = random_direction(random);
        const glm::dvec3 lamp = 5.0 * random_direction(random);
        const glm::dvec3 beam = 2.0 * random_direction(random);

        Phong phong;
        const glm::dvec3 color(0.9, 0.5, 0.2);
        phong.color = color;
        phong.ambient = 0.1;
        phong.diffuse = 0.6;
        phong.specular = 0.3;
        phong.specular_exponent = 7.5;
        phong.ambient_light = {0.3, 0.4, 0.5};
        phong.lights = {PositionalLight{lamp, {1.0, 0.5, 0.25}}, DirectionalLight{beam, {0.2, 0.4, 0.8}}};
        phong.two_sided = false;

        const glm::dvec3 to_light[] = {glm::normalize(lamp - at), -glm::normalize(beam)};
        const glm::dvec3 intensity[] = {{1.0, 0.5, 0.25}, {0.2, 0.4, 0.8}};
        for (int channel = 0; channel < 3; ++channel) {
            double expected = color[channel] * 0.1 * phong.ambient_light[channel];
            for (int k = 0; k < 2; ++k) {
                const double n_l = glm::dot(n, to_light[k]);
                const double v_r = glm::dot(v, 2.0 * n * n_l - to_light[k]);
                expected +=
                    intensity[k][channel] * (color[channel] * 0.6 * clamped(n_l) + 0.3 * std::pow(clamped(v_r), 7.5));
            }
            REQUIRE(shade(phong, {at, n, v})[channel] == Approx(expected).margin(1e-12));
        }
    }
}

TEST_CASE("Phong shades points side by side as it does one", "[shade]")
{
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform;
    for (const double exponent : {0.0, 30.0, 7.5, 2000.0})
        for (const bool two_sided : {false, true}) {
            Phong phong;
            phong.specular_exponent = exponent;
            phong.two_sided = two_sided;
            phong.lights = {PositionalLight{{1.0, 2.0, 3.0}, {1.0, 0.5, 0.25}}, DirectionalLight{{0.3, 0.2, -1.0}}};
            for (std::size_t count = 1; count <= PhongPoints::capacity; ++count) {
                PhongPoints points;
                points.count = count;
                std::vector<glm::dvec3> expected;
                for (std::size_t i = 0; i < count; ++i) {
                    // The first one is where the light is.
                    const glm::dvec3 at = i == 0 ? glm::dvec3(1.0, 2.0, 3.0) : 3.0 * random_direction(random);
                    const glm::dvec3 n = random_direction(random), direction = 5.0 * random_direction(random);
                    const glm::dvec3 color(uniform(random), uniform(random), uniform(random));
                    points.set(i, at, n, direction, color);
                    phong.color = color;
                    expected.push_back(shade(phong, {at, n, -glm::normalize(direction)}));
                }
                PhongColors colors;
                shade(phong, points, colors);
                for (std::size_t i = 0; i < count; ++i)
                    for (int part = 0; part < 3; ++part)
                        REQUIRE(colors.part[part][i] == Approx(expected[i][part]).epsilon(1e-13));
            }
        }
}

TEST_CASE("Phong with two sides turns the normal to the viewer", "[shade]")
{
    std::mt19937 random(2);
    Phong phong;
    phong.lights = {DirectionalLight{{0.3, 0.2, -1.0}}};
    Phong one_sided = phong;
    one_sided.two_sided = false;
    for (int trial = 0; trial < 100; ++trial) {
        const glm::dvec3 v = random_direction(random);
        glm::dvec3 n = random_direction(random);
        if (glm::dot(n, v) < 0.0)
            n = -n;
        require_equal_up_to_rounding(shade(phong, {{}, -n, v}), shade(phong, {{}, n, v}));
        require_equal_up_to_rounding(shade(phong, {{}, n, v}), shade(one_sided, {{}, n, v}));
    }
}

TEST_CASE("Phong without lights, with a light on the point and with a zero exponent", "[shade]")
{
    Phong phong;
    phong.lights.emplace();
    require_equal_up_to_rounding(shade(phong, {}), glm::dvec3(phong.ambient));

    phong.lights = {PositionalLight{}};
    require_equal_up_to_rounding(shade(phong, {}), glm::dvec3(phong.ambient));

    phong.specular_exponent = 0.0;
    phong.lights = {DirectionalLight{{0.0, 0.0, 1.0}}};
    require_equal_up_to_rounding(shade(phong, {}), glm::dvec3(phong.ambient));
}

TEST_CASE("Phong uses the part of each light that reaches the point", "[shade]")
{
    const PositionalLight first{{0.0, 3.0, 4.0}}, second{{1.0, -2.0, 3.0}, {0.5, 0.25, 1.0}};
    Phong both, only_second, dimmed;
    both.lights = {first, second};
    only_second.lights = {second};
    dimmed.lights = {PositionalLight{first.position, 0.25 * first.intensity}, second};
    SurfacePoint point;
    const double hidden[] = {0.0, 1.0}, attenuated[] = {0.25, 1.0};
    point.lit = hidden;
    require_equal_up_to_rounding(shade(both, point), shade(only_second, SurfacePoint{}));
    point.lit = attenuated;
    require_equal_up_to_rounding(shade(both, point), shade(dimmed, SurfacePoint{}));
}

TEST_CASE("Outline is (1 - <N, V>^2)^no, for both signs of the normal", "[shade]")
{
    std::mt19937 random(3);
    for (const double exponent : {0.0, 0.5, 1.0, 2.0, 8.0}) {
        const Outline outline{exponent};
        for (int trial = 0; trial < 100; ++trial) {
            const glm::dvec3 v = random_direction(random);
            const glm::dvec3 n = random_direction(random);
            const glm::dvec3 expected(std::pow(1.0 - std::pow(glm::dot(n, v), 2), exponent));
            require_equal_up_to_rounding(shade(outline, {{}, n, v}), expected);
            require_equal_up_to_rounding(shade(outline, {{}, -n, v}), expected);
        }
    }
    const glm::dvec3 longer_than_one(0.0, 0.0, 1.0 + 1e-12);
    require_equal_up_to_rounding(shade(Outline{0.5}, {{}, longer_than_one, longer_than_one}), glm::dvec3(0.0));
}

TEST_CASE("Outline goes from the surface's colour to the lines' colour", "[shade]")
{
    const Outline ink{1.0, glm::dvec3(0.1, 0.2, 0.3), glm::dvec3(1.0, 0.9, 0.8)};
    require_equal_up_to_rounding(shade(ink, {{}, {0, 0, 1}, {0, 0, 1}}), {1.0, 0.9, 0.8});
    require_equal_up_to_rounding(shade(ink, {{}, {0, 0, 1}, {0, 1, 0}}), {0.1, 0.2, 0.3});
}

TEST_CASE("camera lights fall on what faces the camera", "[shade]")
{
    Phong phong;
    phong.lights = camera_lights({1, 0, 0}, {0, 0, 1}, {0, 1, 0});
    REQUIRE(phong.lights->size() == 2);
    const glm::dvec3 facing = shade(phong, {{}, {0, -1, 0}, {0, -1, 0}});
    const glm::dvec3 upper_left = shade(phong, {{}, glm::normalize(glm::dvec3(-1, -1, 1)), {0, -1, 0}});
    const glm::dvec3 lower_right = shade(phong, {{}, glm::normalize(glm::dvec3(1, -1, -1)), {0, -1, 0}});
    REQUIRE(facing.x > 0.3);
    REQUIRE(upper_left.x > lower_right.x);
    REQUIRE(lower_right.x > phong.ambient);
}

TEST_CASE("shadings refuse bad numbers by name", "[shade]")
{
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Phong phong;
    phong.diffuse = -0.1;
    REQUIRE_THROWS_WITH(validate(phong), ContainsSubstring("diffuse"));
    phong = {};
    phong.color = glm::dvec3(0.5, nan, 0.5);
    REQUIRE_THROWS_WITH(validate(phong), ContainsSubstring("color"));
    phong = {};
    phong.lights = {PositionalLight{{nan, 0, 0}}};
    REQUIRE_THROWS_WITH(validate(phong), ContainsSubstring("position"));
    phong.lights = {DirectionalLight{{0, 0, 0}}};
    REQUIRE_THROWS_WITH(validate(phong), ContainsSubstring("direction"));
    REQUIRE_THROWS_WITH(validate(Shading(Outline{-1.0})), ContainsSubstring("exponent"));
    REQUIRE_NOTHROW(validate(Shading(Phong{})));
    REQUIRE_NOTHROW(validate(Shading(Outline{})));
}
