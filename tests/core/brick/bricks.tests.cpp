#include "isospline/brick/bricks.h"

#include "catch.h"
#include "counting_source.h"
#include "level_bricks.h"
#include "volumes.h"

#include "isospline/math/grid.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
#include <random>
#include <thread>
#include <vector>

using namespace isospline;

namespace {

/// Noise; only a ball in it contains parts of the surfaces at levels about 0.
std::shared_ptr<const Volume> ball_of_noise(const glm::ivec3& shape, int degree)
{
    std::mt19937 random(2);
    std::uniform_real_distribution<float> noise(-1.0f, 1.0f);
    VolumeOptions options;
    options.degree = degree;
    options.filter = Filter::none;
    const auto sample = [&](int x, int y, int z) {
        const float any = noise(random);
        return glm::length(glm::dvec3(x, y, z) - 0.4 * glm::dvec3(shape)) < 0.3 * shape.x ? any : 9.0f;
    };
    return sampled_volume(sample, shape, options);
}

bool is_mixed(const Volume& volume, const glm::ivec3& cell, double threshold)
{
    const float* first = volume.cell_coefficients(cell.x, cell.y, cell.z);
    bool below = false, above = false;
    for (int z = 0; z <= volume.degree(); ++z)
        for (int y = 0; y <= volume.degree(); ++y)
            for (int x = 0; x <= volume.degree(); ++x)
                (first[x + y * volume.row_stride() + z * volume.slice_stride()] < threshold ? below : above) = true;
    return below && above;
}

/// Whether a cell has no corner in all half-spaces' inner sides.
bool is_clipped(const std::vector<HalfSpace>& clip, const glm::ivec3& cell)
{
    return std::any_of(clip.begin(), clip.end(), [&](const HalfSpace& half_space) {
        for (int corner = 0; corner < 8; ++corner)
            if (glm::dot(half_space.normal, glm::dvec3(cell + child_position(corner))) >= half_space.offset)
                return false;
        return true;
    });
}

/// Whether f has one sign at points of a cell.
bool has_one_sign(const Volume& volume, double threshold, const glm::ivec3& cell)
{
    constexpr int points = 6;
    int above = 0;
    for (int z = 0; z < points; ++z)
        for (int y = 0; y < points; ++y)
            for (int x = 0; x < points; ++x) {
                const glm::dvec3 lattice = glm::dvec3(cell) + glm::dvec3(x, y, z) / (points - 1.0);
                const glm::dvec3 index = lattice - (volume.degree() % 2 == 0 ? 0.5 : 0.0);
                above += volume.value(index) - volume.offset() >= threshold;
            }
    return above == 0 || above == points * points * points;
}

template <typename Use>
void for_each_brick(const Bricks& bricks, const Use& use)
{
    for (const Octet& octet : bricks.octets())
        for (unsigned rest = octet.bricks; rest != 0; rest &= rest - 1u)
            use(octet, std::countr_zero(rest));
}

/// All blocks of all bricks, in the order of octets or in a random one. Bricks that `use` is called with are made.
template <typename Use>
void for_each_block(const Bricks& bricks, std::mt19937* shuffle, const Use& use)
{
    struct Place {
        const Octet* octet;
        int child, block;
    };
    std::vector<Place> places;
    for_each_brick(bricks, [&](const Octet& octet, int child) {
        for (int block = 0; block < blocks_per_brick; ++block)
            places.push_back({&octet, child, block});
    });
    if (shuffle != nullptr)
        std::shuffle(places.begin(), places.end(), *shuffle);
    for (const auto& [octet, child, block] : places) {
        BrickPin pin;
        const MadeBrick& brick = bricks.brick(*octet, child, pin);
        if ((brick.blocks() >> block & 1u) == 0)
            continue;
        Block own;
        use(Bricks::number(*octet, child) * blocks_per_brick + static_cast<std::size_t>(block),
            brick.block(block, bricks.degree(), bricks.threshold(), own));
    }
}

} // namespace

TEST_CASE("the bricks of a level hold the mixed cells that masks and clips keep", "[brick]")
{
    const int degree = GENERATE(1, 2, 3);
    const auto volume = ball_of_noise({37, 22, 30}, degree);
    const glm::ivec3 shape = volume->cell_shape();
    Mask mask(37 * 22 * 30, 1);
    for (std::size_t i = 0; i < mask.size(); i += 7)
        mask[i] = 0;
    const std::vector<HalfSpace> clip{{glm::normalize(glm::dvec3(1.0, 2.0, -0.5)), 11.0}, {{0.0, 0.0, -1.0}, -14.0}};
    for (const bool is_masked : {false, true})
        for (const bool is_clip : {false, true})
            for (const double level_of_samples : {0.2, 9.0, 9.5}) {
                const double threshold = level_of_samples - volume->offset();
                const LevelBricks level(volume, threshold, is_masked ? mask : Mask(),
                                        is_clip ? clip : std::vector<HalfSpace>());
                const Bricks& bricks = level.bricks;
                REQUIRE(bricks.degree() == degree);
                REQUIRE(bricks.threshold() == threshold);

                // Octets in the order of the lattice, numbers in the order of octets and children.
                std::uint64_t last_octet = 0;
                std::size_t count = 0;
                for (const Octet& octet : bricks.octets()) {
                    const glm::ivec3 first(octet.first[0], octet.first[1], octet.first[2]);
                    const std::uint64_t place = place_in(octet_shape(shape), first / (2 * brick_size));
                    REQUIRE(first % (2 * brick_size) == glm::ivec3(0));
                    REQUIRE((count == 0 || place > last_octet));
                    REQUIRE(octet.bricks != 0);
                    last_octet = place;
                    for (unsigned rest = octet.bricks; rest != 0; rest &= rest - 1u)
                        REQUIRE(Bricks::number(octet, std::countr_zero(rest)) == count++);
                }
                REQUIRE(bricks.count() == count);

                std::vector<bool> held(place_count(shape));
                for_each_brick(bricks, [&](const Octet& octet, int child) {
                    const Brick place = bricks.place(octet, child);
                    BrickPin pin;
                    const MadeBrick& brick = bricks.brick(octet, child, pin);
                    REQUIRE(brick.first() == place.first);
                    REQUIRE(&bricks.brick(octet, child, pin) == &brick);
                    const BrickCells cells = bricks.cells(place);
                    Block own;
                    for (int block = 0; block < blocks_per_brick; ++block) {
                        const std::uint8_t in_question = cells_of_block(cells, block);
                        if ((brick.blocks() >> block & 1u) == 0) {
                            for (unsigned left = in_question; left != 0; left &= left - 1u)
                                REQUIRE(has_one_sign(*volume, threshold,
                                                     place.first + block_position(block) +
                                                         child_position(std::countr_zero(left))));
                            continue;
                        }
                        // A slab may be empty; a cell of one sign is never in a block.
                        REQUIRE((brick.block(block, degree, threshold, own).cells & ~in_question) == 0);
                    }
                    for_each_cell(cells, [&](int x, int y, int z) {
                        const glm::ivec3 at(x, y, z), cell = place.first + at;
                        REQUIRE(brick.coefficients(at).first == volume->cell_coefficients(cell.x, cell.y, cell.z));
                        held.at(place_in(shape, cell)) = true;
                    });
                });
                std::size_t cells = 0;
                for (std::uint64_t place = 0; place < held.size(); ++place) {
                    const glm::ivec3 cell = at_place(shape, place);
                    const bool expected = is_mixed(*volume, cell, threshold) &&
                                          !(is_masked && is_cut_by_mask(cell, mask, *volume)) &&
                                          !(is_clip && is_clipped(clip, cell));
                    REQUIRE(held[place] == expected);
                    cells += expected;
                }
                REQUIRE((cells > 0) == (level_of_samples < 9.5));
            }
}

TEST_CASE("bricks that are completely outside of a clip are left out", "[brick]")
{
    const auto volume = noise_volume({40, 40, 40}, 2);
    const LevelBricks level(volume, 0.1, {}, {{{1.0, 0.0, 0.0}, 17.0}, {{0.0, -1.0, 0.0}, -8.0}});
    for_each_brick(level.bricks, [&](const Octet& octet, int child) {
        const Brick brick = level.bricks.place(octet, child);
        REQUIRE(brick.first.x >= 16);
        REQUIRE(brick.first.y <= 8);
    });
    REQUIRE(level.bricks.count() == 3 * 2 * 5);
}

TEST_CASE("memory counts the bricks that were made", "[brick]")
{
    const LevelBricks level(noise_volume({40, 33, 24}, 2), 0.1);
    std::size_t before = level.bricks.memory();
    REQUIRE(before >= level.bricks.count() * sizeof(void*));
    std::size_t made = 0;
    for_each_brick(level.bricks, [&](const Octet& octet, int child) {
        BrickPin pin;
        made += level.bricks.brick(octet, child, pin).memory();
        REQUIRE(level.bricks.memory() == before + made);
        level.bricks.brick(octet, child, pin);
        REQUIRE(level.bricks.memory() == before + made);
    });
}

// All threads enter every block of the noise, each in its own order.
TEST_CASE("bricks and blocks are the same for any thread and any order", "[brick][threads]")
{
    const int degree = GENERATE(1, 2, 3);
    const bool is_in_memory = GENERATE(true, false);
    const auto in_memory = noise_volume({37, 22, 30}, degree);
    const auto source_of = [&] { return std::make_shared<CountingSource>(in_memory); };
    const auto volume = is_in_memory ? in_memory : volume_of(source_of(), *in_memory);
    const LevelBricks of_one(volume, 0.1);
    std::vector<Block> expected(of_one.bricks.count() * blocks_per_brick);
    std::vector<bool> has_cells(expected.size());
    for_each_block(of_one.bricks, nullptr, [&](std::size_t index, const Block& block) {
        expected[index] = block;
        has_cells[index] = true;
    });

    constexpr std::size_t thread_count = 8;
    for (int repetition = 0; repetition < 5; ++repetition) {
        const auto source = source_of();
        const LevelBricks level(is_in_memory ? in_memory : volume_of(source, *in_memory), 0.1);
        REQUIRE(level.bricks.count() == of_one.bricks.count());
        std::vector<std::size_t> different(thread_count), entered(thread_count);
        std::vector<std::vector<const MadeBrick*>> bricks_of_thread(thread_count);
        std::vector<std::thread> threads;
        for (std::size_t thread = 0; thread < thread_count; ++thread)
            threads.emplace_back([&, thread] {
                std::mt19937 random(
                    static_cast<unsigned>(thread_count * static_cast<std::size_t>(repetition) + thread));
                for_each_block(level.bricks, &random, [&](std::size_t index, const Block& block) {
                    different[thread] += !has_cells[index] || std::memcmp(&block, &expected[index], sizeof block) != 0;
                    ++entered[thread];
                });
                for_each_brick(level.bricks, [&](const Octet& octet, int child) {
                    BrickPin pin;
                    bricks_of_thread[thread].push_back(&level.bricks.brick(octet, child, pin));
                });
            });
        for (std::thread& thread : threads)
            thread.join();
        const auto count = static_cast<std::size_t>(std::count(has_cells.begin(), has_cells.end(), true));
        for (std::size_t thread = 0; thread < thread_count; ++thread) {
            REQUIRE(different[thread] == 0);
            REQUIRE(entered[thread] == count);
            REQUIRE((bricks_of_thread[thread] == bricks_of_thread[0]));
        }
        REQUIRE(level.bricks.memory() == [&] {
            std::size_t memory = LevelBricks(volume, 0.1).bricks.memory();
            for (const MadeBrick* brick : bricks_of_thread[0])
                memory += brick->memory();
            return memory;
        }());
        if (!is_in_memory) {
            REQUIRE(source->bricks().size() == level.bricks.count());
            REQUIRE(source->asked() >= level.bricks.count());
        }
    }
}

TEST_CASE("if a source refuses a brick, the next call makes it", "[brick]")
{
    const auto volume = noise_volume({20, 12, 9}, 2);
    const auto source = std::make_shared<CountingSource>(volume);
    const LevelBricks level(volume_of(source, *volume), 0.1);
    const Octet& octet = level.bricks.octets().front();
    const int child = std::countr_zero(static_cast<unsigned>(octet.bricks));
    const std::size_t before = level.bricks.memory();
    source->refuse = true;
    BrickPin pin, other;
    REQUIRE_THROWS_AS(level.bricks.brick(octet, child, pin), CountingSource::Refusal);
    REQUIRE(level.bricks.memory() == before);
    source->refuse = false;
    const MadeBrick& brick = level.bricks.brick(octet, child, pin);
    const LevelBricks plain(volume, 0.1);
    REQUIRE(brick.blocks() == plain.bricks.brick(plain.bricks.octets().front(), child, other).blocks());
    REQUIRE(source->asked() == 1);
    REQUIRE(&level.bricks.brick(octet, child, pin) == &brick);
    REQUIRE(source->asked() == 1);
}

TEST_CASE("a pinned brick is not dropped, and nobody waits for its reader", "[brick]")
{
    const auto volume = noise_volume({40, 40, 40}, 2);
    const auto source = std::make_shared<CountingSource>(volume, 1); // any brick exceeds the limit
    const LevelBricks level(volume_of(source, *volume), 0.1), in_memory(volume, 0.1);
    MemoryBudget& budget = *source->budget();
    const Octet &octet = level.bricks.octets().front(), &same_octet = in_memory.bricks.octets().front();
    const int first = std::countr_zero(static_cast<unsigned>(octet.bricks));
    const int second = std::countr_zero(octet.bricks & ~(1u << first));
    BrickPin pin, other, plain;
    const MadeBrick& kept = level.bricks.brick(octet, first, pin);
    std::uint64_t others = 0;
    for_each_brick(level.bricks, [&](const Octet& next, int child) {
        others += &level.bricks.brick(next, child, other) != &kept;
        budget.make_room();
        // The pinned bricks alone are left.
        REQUIRE(budget.held() == kept.memory() + (&level.bricks.brick(next, child, other) == &kept
                                                      ? 0
                                                      : level.bricks.brick(next, child, other).memory()));
    });
    REQUIRE(others > 100);
    REQUIRE(budget.dropped() >= others - 1);
    const MadeBrick& expected = in_memory.bricks.brick(same_octet, first, plain);
    REQUIRE(kept.blocks() == expected.blocks());
    for (const glm::ivec3& cell : {glm::ivec3(0), glm::ivec3(7, 3, 5)})
        REQUIRE(*kept.coefficients(cell).first == *expected.coefficients(cell).first);

    // The next brick that the reader asks for, and the pin's end, let it go.
    level.bricks.brick(octet, second, pin);
    budget.make_room();
    REQUIRE(level.bricks.address_of(octet, first) == nullptr);
    REQUIRE(level.bricks.address_of(octet, second) != nullptr);
}

TEST_CASE("many threads read bricks of which a few fit a budget", "[brick][threads]")
{
    const auto volume = noise_volume({70, 44, 60}, 2);
    const auto source = std::make_shared<CountingSource>(volume, 60'000);
    const LevelBricks level(volume_of(source, *volume), 0.1), in_memory(volume, 0.1);
    constexpr std::size_t thread_count = 8;
    std::vector<std::size_t> wrong(thread_count);
    std::vector<std::thread> threads;
    for (std::size_t thread = 0; thread < thread_count; ++thread)
        threads.emplace_back([&, thread] {
            std::mt19937 random(static_cast<unsigned>(thread));
            BrickPin pin, plain;
            // How much is dropped depends on how the threads take turns.
            for (int i = 0; i < 5000 || (source->budget()->dropped() <= 100 && i < 1'000'000); ++i) {
                const std::size_t at = random() % level.bricks.octets().size();
                const Octet& octet = level.bricks.octets()[at];
                const int child = std::countr_zero(static_cast<unsigned>(octet.bricks));
                const MadeBrick& brick = level.bricks.brick(octet, child, pin);
                if (i % 16 == 0)
                    std::this_thread::yield();
                const MadeBrick& expected = in_memory.bricks.brick(in_memory.bricks.octets()[at], child, plain);
                wrong[thread] +=
                    brick.first() != expected.first() || brick.blocks() != expected.blocks() ||
                    *brick.coefficients(glm::ivec3(3)).first != *expected.coefficients(glm::ivec3(3)).first;
            }
        });
    for (std::thread& thread : threads)
        thread.join();
    REQUIRE(wrong == std::vector<std::size_t>(thread_count));
    REQUIRE(source->budget()->dropped() > 100);
    constexpr std::size_t most_of_brick = 12'000;
    REQUIRE(source->budget()->held() <= 60'000 + 2 * thread_count * most_of_brick);
}
