#include "catch.h"

#include "volumes.h"

#include "isospline/brick/cell_set.h"

#include <random>

using namespace isospline;

TEST_CASE("a set of all cells has all of them", "[brick]")
{
    const CellSet set;
    REQUIRE(set.is_all());
    REQUIRE(set.contains({1000, 2000, 3000}));
    const Brick brick = brick_at({20, 9, 8}, {2, 1, 0});
    REQUIRE(set.has_all_of(brick));
    REQUIRE(!set.has_none_of(brick));
    REQUIRE(set.cells(brick) == all_cells(brick.size));
}

TEST_CASE("a set has the cells that it was made from", "[brick]")
{
    const glm::ivec3 shape{21, 9, 17};
    std::mt19937 random(3);
    std::vector<bool> wanted(static_cast<std::size_t>(place_count(shape)));
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        const glm::ivec3 brick = at_place(shape, i) / brick_size;
        // Bricks with all cells, with none, and with some.
        wanted[i] = brick.x == 0 || (brick.x == 1 && random() % 3 == 0);
    }
    const auto cells_of = [&](std::size_t, const Brick& brick) {
        BrickCells cells = all_cells(brick.size);
        remove_cells(cells, [&](int x, int y, int z) {
            return !wanted[static_cast<std::size_t>(place_in(shape, brick.first + glm::ivec3(x, y, z)))];
        });
        return cells;
    };
    const CellSet set(shape, cells_of);
    REQUIRE(!set.is_all());
    for (std::size_t i = 0; i < wanted.size(); ++i)
        REQUIRE(set.contains(at_place(shape, i)) == wanted[i]);
    const glm::ivec3 bricks = brick_shape(shape);
    for (std::size_t i = 0; i < place_count(bricks); ++i) {
        const Brick brick = brick_at(shape, at_place(bricks, i));
        REQUIRE(set.cells(brick) == cells_of(i, brick));
        REQUIRE(set.has_all_of(brick) == (brick.first.x == 0));
        REQUIRE(set.has_none_of(brick) == (brick.first.x == 16));
    }
}

TEST_CASE("a set has the cells that a mask keeps", "[brick]")
{
    for (const int degree : {1, 2, 3}) {
        const auto volume = noise_volume({19, 10, 9}, degree);
        Mask mask(19 * 10 * 9);
        std::mt19937 random(7);
        for (std::uint8_t& sample : mask)
            sample = random() % 20 != 0;
        const CellSet set(mask, *volume);
        for (std::uint64_t i = 0; i < volume->cell_count(); ++i) {
            const glm::ivec3 cell = at_place(volume->cell_shape(), i);
            REQUIRE(set.contains(cell) != is_cut_by_mask(cell, mask, *volume));
        }
        REQUIRE(CellSet(Mask{}, *volume).is_all());
    }
}
