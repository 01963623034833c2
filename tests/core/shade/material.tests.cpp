#include "catch.h"

#include "isospline/math/frame.h"
#include "isospline/math/random.h"
#include "isospline/shade/material.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <vector>

using namespace isospline;

namespace {

glm::dvec3 direction_at(double degrees)
{
    const double angle = degrees * pi / 180.0;
    return {std::sin(angle), 0.0, std::cos(angle)};
}

/// Cells of a grid over the hemisphere: cosine squared by azimuth.
constexpr std::size_t rows = 12, columns = 16;

std::size_t cell_of(const glm::dvec3& w)
{
    const auto row = std::min(static_cast<std::size_t>(w.z * w.z * rows), rows - 1);
    const double turn = std::atan2(w.y, w.x) / (2.0 * pi) + 0.5;
    return row * columns + std::min(static_cast<std::size_t>(turn * columns), columns - 1);
}

} // namespace

TEST_CASE("materials sample directions with the stated density", "[shade][slow]")
{
    for (const double roughness : {0.3, 0.6, 1.0})
        for (const double metallic : {0.0, 1.0})
            for (const double angle : {0.0, 40.0, 80.0}) {
                const Scattering scattering({glm::dvec3(0.5), metallic, roughness, 1.0});
                const glm::dvec3 viewer = direction_at(angle);

                // The density's integral over each cell, by the midpoint rule.
                constexpr int steps = 64;
                std::vector<double> expected(rows * columns, 0.0);
                double total = 0.0;
                for (std::size_t row = 0; row < rows; ++row)
                    for (std::size_t column = 0; column < columns; ++column)
                        for (int i = 0; i < steps; ++i)
                            for (int j = 0; j < steps; ++j) {
                                const double lower = (row + i / double(steps)) / rows;
                                const double upper = (row + (i + 1) / double(steps)) / rows;
                                const double z = std::sqrt(0.5 * (lower + upper));
                                const double azimuth = 2.0 * pi * ((column + (j + 0.5) / steps) / columns - 0.5);
                                const double radius = std::sqrt(1.0 - z * z);
                                const glm::dvec3 w(radius * std::cos(azimuth), radius * std::sin(azimuth), z);
                                const double solid_angle =
                                    (std::sqrt(upper) - std::sqrt(lower)) * 2.0 * pi / (columns * steps);
                                const double part = scattering.density(viewer, w) * solid_angle;
                                expected[row * columns + column] += part;
                                total += part;
                            }

                constexpr int count = 100000;
                std::vector<double> found(rows * columns, 0.0);
                int drawn = 0;
                for (int i = 0; i < count; ++i) {
                    RandomSequence random({i, 7}, 1);
                    const double choice = random.next();
                    if (const auto sample = scattering.sample(viewer, choice, random.next2())) {
                        found[cell_of(sample->direction)] += 1.0;
                        ++drawn;
                        REQUIRE(glm::length(sample->direction) == Approx(1.0).epsilon(1e-9));
                        REQUIRE(sample->density == Approx(scattering.density(viewer, sample->direction)));
                        const glm::dvec3 weight =
                            scattering.evaluate(viewer, sample->direction) * (sample->direction.z / sample->density);
                        REQUIRE(glm::distance(sample->weight, weight) < 1e-9 * (1.0 + glm::length(weight)));
                    }
                }
                CAPTURE(roughness, metallic, angle, total, drawn);
                // What is drawn below the surface is missing from both.
                REQUIRE(total <= 1.001);
                REQUIRE(drawn / double(count) == Approx(total).margin(5e-3));
                double chi_squared = 0.0;
                int cells = 0;
                for (std::size_t i = 0; i < expected.size(); ++i)
                    if (expected[i] * count > 10.0) {
                        const double deviation = found[i] - expected[i] * count;
                        chi_squared += deviation * deviation / (expected[i] * count);
                        ++cells;
                    }
                REQUIRE(cells > 10);
                REQUIRE(chi_squared < cells + 6.0 * std::sqrt(2.0 * cells));
            }
}

TEST_CASE("a material without coat and metal is Lambert's law, to rounding", "[shade]")
{
    const Scattering scattering({glm::dvec3(1.0, 0.5, 0.25), 0.0, 0.2, 0.0});
    for (int i = 0; i < 1000; ++i) {
        RandomSequence random({i, 0}, 0);
        const glm::dvec3 viewer = cosine_direction(random.next2());
        const double choice = random.next();
        const auto sample = scattering.sample(viewer, choice, random.next2());
        REQUIRE(sample);
        REQUIRE(glm::distance(sample->weight, glm::dvec3(1.0, 0.5, 0.25)) < 1e-14);
    }
}
