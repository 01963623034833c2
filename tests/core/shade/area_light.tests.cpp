#include "catch.h"

#include "isospline/math/frame.h"
#include "isospline/math/random.h"
#include "isospline/shade/area_light.h"
#include "isospline/shade/environment_light.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <vector>

using namespace isospline;

namespace {

constexpr int count = 200000;

/// An even direction.
glm::dvec3 direction_of(const glm::dvec2& u)
{
    const double z = 1.0 - 2.0 * u.x, radius = std::sqrt(std::max(1.0 - z * z, 0.0)), angle = 2.0 * pi * u.y;
    return {radius * std::cos(angle), radius * std::sin(angle), z};
}

/// The solid angle of a light, as drawn directions and as even directions that meet it tell it, and whether both agree
/// on where it is and with which density it is drawn.
template <typename AnyLight>
void require_consistent(const AnyLight& light, const glm::dvec3& position)
{
    double drawn = 0.0, met = 0.0, integral = 0.0;
    for (int i = 0; i < count; ++i) {
        RandomSequence random({i, 3}, 0);
        if (const auto sampled = sample(light, position, random.next2())) {
            REQUIRE(glm::length(sampled->direction) == Approx(1.0).epsilon(1e-9));
            REQUIRE(glm::distance(sampled->weight * sampled->density, light.radiance) < 1e-6);
            drawn += 1.0 / sampled->density;
            const auto emitted = emission(light, Ray{position, sampled->direction});
            // Rounding may take a direction to the rim past it.
            if (emitted) {
                REQUIRE(emitted->density == Approx(sampled->density).epsilon(1e-6));
                REQUIRE(emitted->t == Approx(sampled->distance).epsilon(1e-4));
            } else {
                REQUIRE(i % 1000 != 1);
            }
        }
        if (const auto emitted = emission(light, Ray{position, direction_of(random.next2())})) {
            met += 4.0 * pi;
            integral += 4.0 * pi * emitted->density;
        }
    }
    CAPTURE(drawn / count, met / count);
    REQUIRE(drawn / count == Approx(met / count).epsilon(0.03));
    REQUIRE(integral / count == Approx(1.0).epsilon(0.03));
}

} // namespace

TEST_CASE("lamps are sampled with the stated density, at the places where rays meet them", "[shade]")
{
    require_consistent(SphereLight{{1, 2, 3}, 1.0, {1, 2, 3}}, {0, 0, 0});
    require_consistent(SphereLight{{1, 2, 3}, 3.7, {1, 2, 3}}, {0, 0, 0});
    require_consistent(SphereLight{{1, 2, 3}, 5.0, {1, 2, 3}}, {0, 0, 0});
    require_consistent(SphereLight{{1, 2, 3}, 5.0, {1, 2, 3}}, {1, 2, 3});
    require_consistent(RectangleLight{{-1, -1, 2}, {0, 3, 1}, {2, 1, 0}, {1, 2, 3}}, {0.3, 0.2, 0});
}

TEST_CASE("a rectangle gives light to one side", "[shade]")
{
    const RectangleLight light{{-1, -1, 2}, {0, 2, 0}, {2, 0, 0}};
    REQUIRE(sample(light, {0, 0, 1}, {0.5, 0.5}));
    REQUIRE_FALSE(sample(light, {0, 0, 3}, {0.5, 0.5}));
    REQUIRE_FALSE(sample(light, {5, 0, 2}, {0.5, 0.5}));
    REQUIRE(emission(light, Ray{{0, 0, 1}, {0, 0, 1}})->t == Approx(1.0));
    REQUIRE_FALSE(emission(light, Ray{{0, 0, 3}, {0, 0, -1}}));
    REQUIRE_FALSE(emission(light, Ray{{0, 0, 1}, {0, 0, -1}}));
    REQUIRE_FALSE(emission(light, Ray{{0, 0, 1}, {0, 0, 1}, 0.0, 0.5}));
    REQUIRE_FALSE(emission(light, Ray{{1.5, 0, 1}, {0, 0, 1}}));
}

TEST_CASE("an environment is sampled by its luminance", "[shade]")
{
    std::vector<glm::vec3> pixels(7 * 13);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        RandomSequence random({static_cast<int>(i), 0}, 0);
        // Black ones between, at the beginning, and at the end of a row.
        const bool black = i == 0 || i == 12 || i % 5 == 0 || i / 13 == 3;
        pixels[i] = black ? glm::vec3(0.0f) : glm::vec3(random.next(), random.next(), random.next());
    }
    EnvironmentLight light{glm::dvec3(1.0), std::make_shared<EnvironmentMap>(glm::ivec2(13, 7), pixels)};
    const double c = std::cos(0.7), s = std::sin(0.7);
    light.rotation = glm::dmat3(c, s, 0, -s, c, 0, 0, 0, 1) * glm::dmat3(1, 0, 0, 0, c, s, 0, -s, c);
    validate(light);

    glm::dvec3 drawn(0.0), even(0.0);
    double integral = 0.0;
    int at_rims = 0;
    for (int i = 0; i < count; ++i) {
        RandomSequence random({i, 3}, 0);
        const auto sampled = sample(light, random.next2());
        REQUIRE(sampled);
        REQUIRE(sampled->density > 0.0);
        const Emission emitted = emission(light, sampled->direction);
        at_rims += std::abs(emitted.density - sampled->density) > 1e-9 * sampled->density;
        drawn += sampled->weight;
        const Emission any = emission(light, direction_of(random.next2()));
        even += 4.0 * pi * any.radiance;
        integral += 4.0 * pi * any.density;
    }
    REQUIRE(at_rims < 5); // a direction between two pixels may be rounded to the other
    REQUIRE(integral / count == Approx(1.0).epsilon(0.01));
    for (int channel = 0; channel < 3; ++channel)
        REQUIRE(drawn[channel] / count == Approx(even[channel] / count).epsilon(0.01));

    light.map = std::make_shared<EnvironmentMap>(glm::ivec2(13, 7), std::vector<glm::vec3>(7 * 13, glm::vec3(0.0f)));
    REQUIRE_FALSE(sample(light, {0.5, 0.5}));
    REQUIRE(emission(light, {0, 0, 1}).density == 0.0);
    REQUIRE_THROWS_WITH(EnvironmentMap(glm::ivec2(2, 2), pixels), ContainsSubstring("image"));
}
