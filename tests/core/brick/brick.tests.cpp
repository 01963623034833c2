#include "catch.h"

#include "isospline/brick/brick.h"
#include "isospline/math/grid.h"

#include <algorithm>
#include <random>
#include <set>
#include <tuple>
#include <vector>

using namespace isospline;

namespace {

/// The index of a cell of a brick in the order of blocks, x fastest, and of the cells of each.
int index_by_blocks(const glm::ivec3& cell)
{
    const int block = cell.x / 2 + 4 * (cell.y / 2) + 16 * (cell.z / 2);
    return 8 * block + cell.x % 2 + 2 * (cell.y % 2) + 4 * (cell.z % 2);
}

} // namespace

TEST_CASE("bricks cover every cell once", "[brick]")
{
    const glm::ivec3 cells(17, 8, 3);
    REQUIRE(brick_shape(cells) == glm::ivec3(3, 1, 1));
    std::vector<int> visits(17 * 8 * 3);
    for (int index = 0; index < 3; ++index) {
        const Brick brick = brick_at(cells, {index, 0, 0});
        for (int z = 0; z < brick.size.z; ++z)
            for (int y = 0; y < brick.size.y; ++y)
                for (int x = 0; x < brick.size.x; ++x) {
                    const glm::ivec3 cell = brick.first + glm::ivec3(x, y, z);
                    ++visits[static_cast<std::size_t>(cell.x + 17 * (cell.y + 8 * cell.z))];
                }
    }
    for (const int count : visits)
        REQUIRE(count == 1);
}

TEST_CASE("a brick is at eight cells a place along each axis", "[brick]")
{
    const glm::ivec3 cells(16, 24, 27);
    REQUIRE(brick_at(cells, {1, 0, 0}).first == glm::ivec3(8, 0, 0));
    REQUIRE(brick_at(cells, {0, 1, 0}).first == glm::ivec3(0, 8, 0));
    REQUIRE(brick_at(cells, {0, 0, 1}).first == glm::ivec3(0, 0, 8));
    REQUIRE(brick_at(cells, {1, 2, 3}).first == glm::ivec3(8, 16, 24));
    REQUIRE(brick_at(cells, {1, 2, 2}).size == glm::ivec3(8));
    REQUIRE(brick_at(cells, {1, 2, 3}).size == glm::ivec3(8, 8, 3));
}

TEST_CASE("octets hold every brick once", "[brick]")
{
    for (const glm::ivec3 cells : {glm::ivec3(1), glm::ivec3(16, 17, 33), glm::ivec3(40, 8, 9)}) {
        const glm::ivec3 bricks = brick_shape(cells), octets = octet_shape(cells);
        std::vector<int> visits(place_count(bricks));
        for (std::uint64_t octet = 0; octet < place_count(octets); ++octet)
            for (int child = 0; child < 8; ++child) {
                const glm::ivec3 position = 2 * at_place(octets, octet) + child_position(child);
                if (position.x < bricks.x && position.y < bricks.y && position.z < bricks.z)
                    ++visits[place_in(bricks, position)];
            }
        REQUIRE(visits == std::vector<int>(visits.size(), 1));
    }
}

TEST_CASE("blocks and their cells are counted with x varying fastest", "[brick]")
{
    REQUIRE(child_position(0) == glm::ivec3(0, 0, 0));
    REQUIRE(child_position(1) == glm::ivec3(1, 0, 0));
    REQUIRE(child_position(2) == glm::ivec3(0, 1, 0));
    REQUIRE(child_position(4) == glm::ivec3(0, 0, 1));
    for (int block = 0; block < blocks_per_brick; ++block)
        for (int child = 0; child < 8; ++child)
            REQUIRE(index_by_blocks(block_position(block) + child_position(child)) == 8 * block + child);
}

TEST_CASE("the cells of a set that are in a block are found", "[brick]")
{
    std::mt19937_64 random(6);
    for (int repetition = 0; repetition < 50; ++repetition) {
        BrickCells cells;
        for (std::uint64_t& word : cells)
            word = random() & random();
        for (int block = 0; block < blocks_per_brick; ++block)
            for (int child = 0; child < 8; ++child) {
                const glm::ivec3 at = block_position(block) + child_position(child);
                const bool is_in_set = (cells[static_cast<std::size_t>(at.z)] >> (at.x + 8 * at.y) & 1u) != 0;
                REQUIRE((cells_of_block(cells, block) >> child & 1) == is_in_set);
            }

        // The same cells in both orders, each of which rises.
        std::vector<std::tuple<int, int, int>> by_rows;
        std::vector<int> by_blocks;
        for_each_cell(cells, [&](int x, int y, int z) { by_rows.emplace_back(z, y, x); });
        for_each_cell_by_blocks(cells, [&](int x, int y, int z) { by_blocks.push_back(index_by_blocks({x, y, z})); });
        REQUIRE(by_rows.size() == count_cells(cells));
        REQUIRE(std::is_sorted(by_rows.begin(), by_rows.end()));
        REQUIRE(std::is_sorted(by_blocks.begin(), by_blocks.end()));
        std::set<int> expected;
        for (const auto& [z, y, x] : by_rows)
            expected.insert(index_by_blocks({x, y, z}));
        REQUIRE(expected.size() == by_rows.size());
        REQUIRE(std::vector<int>(expected.begin(), expected.end()) == by_blocks);
    }
}

TEST_CASE("sets of cells are visited in the order of z, y, x, and cells are removed from them", "[brick]")
{
    BrickCells cells{};
    cells[0] = 0x8000000000000001u;
    cells[7] = 0x0000000000000102u;
    REQUIRE(count_cells(cells) == 4);

    std::vector<glm::ivec3> visited;
    const auto visit = [&](int x, int y, int z) { visited.emplace_back(x, y, z); };
    for_each_cell(cells, visit);
    REQUIRE(visited == std::vector<glm::ivec3>{{0, 0, 0}, {7, 7, 0}, {1, 0, 7}, {0, 1, 7}});

    visited.clear();
    cells[1] = 0x0000000000000001u;
    for_each_cell_by_blocks(cells, visit);
    REQUIRE(visited == std::vector<glm::ivec3>{{0, 0, 0}, {0, 0, 1}, {7, 7, 0}, {1, 0, 7}, {0, 1, 7}});
    cells[1] = 0;

    remove_cells(cells, [](int x, int, int z) { return x == 7 || z == 7; });
    visited.clear();
    for_each_cell(cells, visit);
    REQUIRE(visited == std::vector<glm::ivec3>{{0, 0, 0}});
}
