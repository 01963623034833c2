#include "catch.h"

#include "volumes.h"

#include "isospline/brick/ranges.h"
#include "isospline/math/grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <thread>
#include <vector>

using namespace isospline;

namespace {

/// The range of all coefficients that influence a brick's cells.
BrickRanges::Range range_of(const Volume& volume, const Brick& brick)
{
    const float* first = volume.cell_coefficients(brick.first.x, brick.first.y, brick.first.z);
    BrickRanges::Range range{*first, *first};
    for (int z = 0; z < brick.size.z + volume.degree(); ++z)
        for (int y = 0; y < brick.size.y + volume.degree(); ++y)
            for (int x = 0; x < brick.size.x + volume.degree(); ++x) {
                const float c = first[x + y * volume.row_stride() + z * volume.slice_stride()];
                range = {std::min(range.lower, c), std::max(range.upper, c)};
            }
    return range;
}

/// The part of a block that is in its brick, as a brick; its size is zero if there is none.
Brick block_of(const Brick& brick, int block)
{
    const glm::ivec3 first = block_position(block), size = glm::min(brick.size - first, glm::ivec3(2));
    const bool is_in_brick = size.x > 0 && size.y > 0 && size.z > 0;
    return {brick.first + first, is_in_brick ? size : glm::ivec3(0)};
}

/// The range of f - offset at points of a box of cells.
BrickRanges::Range range_of_values(const Volume& volume, const Brick& cells)
{
    constexpr int points = 4; // along an edge of a cell
    double lower = 1e9, upper = -1e9;
    for (int z = 0; z <= points * cells.size.z; ++z)
        for (int y = 0; y <= points * cells.size.y; ++y)
            for (int x = 0; x <= points * cells.size.x; ++x) {
                const glm::dvec3 lattice = glm::dvec3(cells.first) + glm::dvec3(x, y, z) / double(points);
                const double f = volume.value(lattice - (volume.degree() % 2 == 0 ? 0.5 : 0.0)) - volume.offset();
                lower = std::min(lower, f);
                upper = std::max(upper, f);
            }
    return {static_cast<float>(lower), static_cast<float>(upper)};
}

} // namespace

TEST_CASE("ranges of bricks are those of the coefficients that influence their cells", "[brick][threads]")
{
    for (const auto& shape : {glm::ivec3(20, 9, 17), glm::ivec3(16, 8, 8), glm::ivec3(3, 2, 2), glm::ivec3(9, 33, 2)})
        for (int degree = 1; degree <= 3; ++degree) {
            const auto volume = noise_volume(shape, degree);
            const glm::ivec3 cells = volume->cell_shape(), bricks = brick_shape(cells);
            const BrickRanges ranges(*volume);
            REQUIRE(ranges.shape() == octet_shape(cells));
            REQUIRE(ranges.octets().size() == place_count(ranges.shape()));
            for (std::size_t index = 0; index < ranges.octets().size(); ++index) {
                unsigned straddling = 0;
                for (int child = 0; child < 8; ++child) {
                    const glm::ivec3 position = 2 * at_place(ranges.shape(), index) + child_position(child);
                    const auto range = ranges.octets()[index].brick(static_cast<std::size_t>(child));
                    if (position.x >= bricks.x || position.y >= bricks.y || position.z >= bricks.z) {
                        REQUIRE(range.lower > range.upper);
                        continue;
                    }
                    const auto expected = range_of(*volume, brick_at(cells, position));
                    REQUIRE(range.lower == expected.lower);
                    REQUIRE(range.upper == expected.upper);
                    straddling |= static_cast<unsigned>(expected.straddles(0.9)) << child;
                }
                REQUIRE(ranges.straddling(index, 0.9) == straddling);
            }
        }
}

TEST_CASE("all blocks with both signs of f are found, and few others", "[brick][threads]")
{
    std::size_t told[4] = {}, straddling[4] = {}, crossed[4] = {};
    for (const auto& shape : {glm::ivec3(20, 9, 17), glm::ivec3(16, 8, 8), glm::ivec3(3, 2, 2), glm::ivec3(9, 33, 2)})
        for (int degree = 1; degree <= 3; ++degree) {
            const auto volume = noise_volume(shape, degree);
            const glm::ivec3 cells = volume->cell_shape();
            const BrickRanges ranges(*volume);
            for (std::size_t index = 0; index < ranges.octets().size(); ++index)
                for (int child = 0; child < 8; ++child) {
                    const Brick brick = brick_at(cells, 2 * at_place(ranges.shape(), index) + child_position(child));
                    const auto range = ranges.octets()[index].brick(static_cast<std::size_t>(child));
                    if (range.lower > range.upper)
                        continue;
                    std::vector<double> thresholds{0.9, -0.3, std::nextafter(static_cast<double>(range.lower), 1e9),
                                                   static_cast<double>(range.upper)};
                    std::array<BrickRanges::Range, blocks_per_brick> values{};
                    for (int block = 0; block < blocks_per_brick; ++block)
                        if (const Brick cube = block_of(brick, block); cube.size.x > 0) {
                            values[static_cast<std::size_t>(block)] = range_of_values(*volume, cube);
                            thresholds.push_back(static_cast<double>(range_of(*volume, cube).upper));
                        }
                    for (const double threshold : thresholds) {
                        if (!range.straddles(threshold))
                            continue;
                        const std::uint64_t blocks = ranges.straddling_blocks(index, child, threshold);
                        for (int block = 0; block < blocks_per_brick; ++block) {
                            const Brick cube = block_of(brick, block);
                            const bool is_told = (blocks >> block & 1u) != 0;
                            const bool is_crossed = cube.size.x > 0 &&
                                                    values[static_cast<std::size_t>(block)].lower < threshold - 1e-6 &&
                                                    values[static_cast<std::size_t>(block)].upper > threshold + 1e-6;
                            REQUIRE((is_told || !is_crossed));
                            REQUIRE((cube.size.x > 0 || !is_told));
                            told[degree] += is_told;
                            crossed[degree] += is_crossed;
                            straddling[degree] += cube.size.x > 0 && range_of(*volume, cube).straddles(threshold);
                        }
                    }
                }
        }
    // Compared with the ranges of the coefficients that reach a block. At degree 1, these are tight; codes are rounded
    // outwards by 1/255 of a brick's range, which counts here because most thresholds are ends of blocks' ranges.
    constexpr double most_told[4] = {0.0, 1.07, 0.5, 0.1};
    for (int degree = 1; degree <= 3; ++degree) {
        CAPTURE(degree, told[degree], straddling[degree], crossed[degree]);
        REQUIRE(crossed[degree] > 900);
        REQUIRE(static_cast<double>(told[degree]) < most_told[degree] * static_cast<double>(straddling[degree]));
    }
}

TEST_CASE("a range straddles a threshold if both signs occur; zero counts as positive", "[brick]")
{
    const BrickRanges::Range range{-1.0f, 2.0f};
    REQUIRE(range.straddles(0.0));
    REQUIRE(range.straddles(2.0));
    REQUIRE(!range.straddles(-1.0));
    REQUIRE(!range.straddles(2.0 + 1e-12));
    REQUIRE(range.straddles(-1.0 + 1e-12));
}

TEST_CASE("threads that need the ranges of a volume at the same time share them", "[brick][threads]")
{
    for (int repetition = 0; repetition < 20; ++repetition) {
        const auto volume = noise_volume({40, 40, 40}, 2);
        std::vector<std::shared_ptr<const BrickRanges>> ranges(8);
        std::vector<std::thread> threads;
        for (auto& of_thread : ranges)
            threads.emplace_back([&] { of_thread = shared_ranges(volume); });
        for (std::thread& thread : threads)
            thread.join();
        for (const auto& of_thread : ranges)
            REQUIRE(of_thread == ranges[0]);
        REQUIRE_THROWS_AS(shared_ranges(noise_volume({40, 40, 40}, 2), [](double) { return false; }), Cancelled);
        REQUIRE(shared_ranges(volume) == ranges[0]);
    }
}

TEST_CASE("f is on the side of a block that its codes tell", "[brick]")
{
    for (int degree = 1; degree <= 3; ++degree) {
        // A ramp along x, with noise.
        std::mt19937 random(3);
        std::uniform_real_distribution<double> within(0.0, 1.0);
        std::vector<float> samples(19 * 12 * 10);
        for (std::size_t i = 0; i < samples.size(); ++i)
            samples[i] = static_cast<float>(i % 19) + static_cast<float>(within(random));
        VolumeOptions options;
        options.degree = degree;
        const auto volume = make_volume(samples, {19, 12, 10}, options);
        const BrickRanges ranges(*volume);
        int known = 0;
        for (const double level : {10.0, 12.5, 14.0}) {
            const double threshold = level - volume->offset();
            const double least = threshold - 0.05, most = threshold + 0.05;
            const Brick brick = brick_at(volume->cell_shape(), {1, 0, 0});
            const BrickRanges::BlockSides sides = ranges.block_sides({1, 0, 0}, least, most);
            for (int block = 0; block < blocks_per_brick; ++block) {
                const Brick part = block_of(brick, block);
                const int side = sides[static_cast<std::size_t>(block)];
                if (part.size.x == 0 || side == 0)
                    continue;
                ++known;
                for (int i = 0; i < 50; ++i) {
                    const glm::dvec3 offset(within(random), within(random), within(random));
                    const glm::dvec3 lattice = glm::dvec3(part.first) + offset * glm::dvec3(part.size);
                    const double f = volume->value(lattice - volume->lattice_shift()) - volume->offset();
                    const bool agrees = side > 0 ? f > most : f < least;
                    REQUIRE(agrees);
                }
            }
        }
        REQUIRE(known > 20);
    }
}
