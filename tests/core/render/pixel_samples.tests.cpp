#include "catch.h"

#include "isospline/render/pixel_samples.h"

#include <cmath>
#include <set>

using namespace isospline;

TEST_CASE("pixel samples are spread evenly about the centre, which comes first", "[render]")
{
    for (const int count : {1, 2, 3, 4, 5, 8, 9, 16, 25, 37, 64, 256}) {
        const std::vector<PixelSample> samples = pixel_samples(count);
        REQUIRE(samples.front().position == glm::dvec2(0.5));
        REQUIRE((samples.front().weight > 0.0) == (count % 2 == 1));
        REQUIRE(samples.size() == static_cast<std::size_t>(count % 2 == 1 ? count : count + 1));

        double weight = 0.0;
        glm::dvec2 mean(0.0);
        std::set<int> columns, rows;
        for (const PixelSample& sample : samples) {
            weight += sample.weight;
            mean += sample.weight * sample.position;
            if (sample.weight > 0.0) {
                columns.insert(static_cast<int>(std::floor(sample.position.x * count)));
                rows.insert(static_cast<int>(std::floor(sample.position.y * count)));
            }
        }
        REQUIRE(weight == Approx(1.0));
        REQUIRE(mean.x == Approx(0.5));
        REQUIRE(mean.y == Approx(0.5));
        REQUIRE(columns.size() == static_cast<std::size_t>(count));
        REQUIRE(rows.size() == static_cast<std::size_t>(count));
    }
}

TEST_CASE("pixel samples integrate a smooth function", "[render]")
{
    double sum = 0.0;
    for (const PixelSample& sample : pixel_samples(64))
        sum += sample.weight * std::exp(sample.position.x + 0.5 * sample.position.y);
    const double exact = (std::exp(1.0) - 1.0) * (std::exp(0.5) - 1.0) / 0.5;
    REQUIRE(sum == Approx(exact).epsilon(1e-2));
}

TEST_CASE("pixel samples refuse an invalid count", "[render]")
{
    REQUIRE_THROWS_AS(pixel_samples(0), std::invalid_argument);
    REQUIRE_THROWS_AS(pixel_samples(-4), std::invalid_argument);
    REQUIRE_THROWS_AS(pixel_samples(65537), std::invalid_argument);
    REQUIRE(pixel_samples(65536).size() == 65537);
}

TEST_CASE("with a lens, all samples except the one of the centres are spread over the unit disc", "[render]")
{
    for (const int count : {1, 4, 9, 64}) {
        const std::vector<PixelSample> samples = pixel_samples(count, true);
        REQUIRE(samples.size() == static_cast<std::size_t>(count) + 1);
        REQUIRE(samples.front().position == glm::dvec2(0.5));
        REQUIRE(samples.front().weight == 0.0);
        REQUIRE(lens_position(samples.front(), {3, 5}) == glm::dvec2(0.0));
    }

    // Moments of the uniform disc: mean 0, mean square 1/4 in each direction, in every pixel.
    for (const glm::ivec2 pixel : {glm::ivec2(0, 0), glm::ivec2(17, 4), glm::ivec2(1919, 1079)}) {
        glm::dvec2 mean(0.0), mean_square(0.0);
        double mixed = 0.0;
        for (const PixelSample& sample : pixel_samples(1024, true)) {
            const glm::dvec2 lens = lens_position(sample, pixel);
            REQUIRE(lens.x * lens.x + lens.y * lens.y <= 1.0);
            mean += sample.weight * lens;
            mean_square += sample.weight * lens * lens;
            mixed += sample.weight * lens.x * sample.position.x;
        }
        for (int axis = 0; axis < 2; ++axis) {
            REQUIRE(mean[axis] == Approx(0.0).margin(5e-3));
            REQUIRE(mean_square[axis] == Approx(0.25).margin(5e-3));
        }
        REQUIRE(mixed == Approx(0.0).margin(1e-2)); // places on the lens do not go with places in the pixel
    }
}
