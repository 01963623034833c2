#include "catch.h"

#include "volumes.h"

#include "isospline/brick/cutout.h"

#include <glm/geometric.hpp>

#include <random>
#include <vector>

using namespace isospline;

namespace {

class Random {
public:
    explicit Random(unsigned seed) : generator_(seed) {}

    double number(double lower, double upper)
    {
        return std::uniform_real_distribution<double>(lower, upper)(generator_);
    }
    glm::dvec3 vector() { return {number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0)}; }

private:
    std::mt19937 generator_;
};

} // namespace

TEST_CASE("half-spaces cut the cells away that have no corner inside", "[brick]")
{
    Random random(3);
    const Brick brick{{8, 16, 24}, {8, 8, 8}};
    for (int i = 0; i < 300; ++i) {
        const glm::dvec3 normal = glm::normalize(random.vector());
        const glm::dvec3 point = glm::dvec3(12.0, 20.0, 28.0) + 8.0 * random.vector();
        const HalfSpace half_space{normal, glm::dot(normal, point)};
        BrickCells cells, expected;
        cells.fill(~std::uint64_t(0));
        expected = cells;
        remove_cells(expected, [&](int x, int y, int z) {
            for (int corner = 0; corner < 8; ++corner) {
                const glm::ivec3 at(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
                if (glm::dot(normal, glm::dvec3(brick.first + at)) >= half_space.offset)
                    return false;
            }
            return true;
        });
        cut_by_half_space(cells, brick, half_space);
        REQUIRE(cells == expected);
    }
}

TEST_CASE("cells that touch a half-space stay", "[brick]")
{
    BrickCells cells;
    cells.fill(~std::uint64_t(0));
    cut_by_half_space(cells, {{0, 0, 0}, {8, 8, 8}}, {{0.0, 0.0, 1.0}, 5.0});
    for (std::size_t z = 0; z < 8; ++z)
        REQUIRE((cells[z] != 0) == (z >= 4));
}

TEST_CASE("a mask cuts cells away by their centre or by any corner", "[brick]")
{
    for (int degree = 1; degree <= 3; ++degree) {
        const auto volume = noise_volume({10, 5, 4}, degree);
        Mask mask(10 * 5 * 4, 1);
        mask[8 + 10 * (2 + 5 * 1)] = 0;
        std::vector<glm::ivec3> removed;
        for (int index = 0; index < 2; ++index) {
            const Brick brick = brick_at(volume->cell_shape(), {index, 0, 0});
            BrickCells cells{};
            for (int z = 0; z < brick.size.z; ++z)
                for (int y = 0; y < brick.size.y; ++y)
                    cells[static_cast<std::size_t>(z)] |= ((std::uint64_t(1) << brick.size.x) - 1) << 8 * y;
            BrickCells left = cells;
            cut_by_mask(left, brick, mask, *volume);
            for (std::size_t z = 0; z < 8; ++z)
                cells[z] &= ~left[z];
            for_each_cell(cells, [&](int x, int y, int z) { removed.push_back(brick.first + glm::ivec3(x, y, z)); });
        }
        if (degree == 2) {
            REQUIRE(removed == std::vector<glm::ivec3>{{8, 2, 1}});
        } else {
            REQUIRE(removed.size() == 8);
            for (const glm::ivec3& cell : removed)
                REQUIRE((glm::ivec3(8, 2, 1) - cell == glm::clamp(glm::ivec3(8, 2, 1) - cell, 0, 1)));
        }
    }
}
