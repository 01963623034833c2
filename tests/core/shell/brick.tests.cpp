#include "catch.h"

#include "isospline/shell/brick.h"

#include <vector>

using namespace isospline;

TEST_CASE("bricks cover every cell once", "[shell]")
{
    const glm::ivec3 cells(17, 8, 3);
    REQUIRE(brick_shape(cells) == glm::ivec3(3, 1, 1));
    std::vector<int> visits(17 * 8 * 3);
    for (std::size_t index = 0; index < 3; ++index) {
        const Brick brick = brick_at(cells, index);
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

TEST_CASE("bricks are counted with x varying fastest", "[shell]")
{
    const glm::ivec3 cells(16, 24, 32);
    REQUIRE(brick_at(cells, 1).first == glm::ivec3(8, 0, 0));
    REQUIRE(brick_at(cells, 2).first == glm::ivec3(0, 8, 0));
    REQUIRE(brick_at(cells, 6).first == glm::ivec3(0, 0, 8));
    REQUIRE(brick_at(cells, 23).first == glm::ivec3(8, 16, 24));
}

TEST_CASE("sets of cells are visited in the order of z, y, x, and cells are removed from them", "[shell]")
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
