#include "catch.h"
#include "each_target.h"
#include "random_cells.h"

#include "isospline/brick/block.h"
#include "isospline/cell/intersector.h"

#include <glm/geometric.hpp>

#include <random>

using namespace isospline;

namespace {

/// The block of a single cell.
Block block_of(int degree, const CellCoefficients& cell)
{
    return make_block(cell, degree, cell.threshold, 1);
}

} // namespace

TEST_CASE("the slab of a cell holds the surface", "[brick]")
{
    const int degree = GENERATE(1, 2, 3);
    const Volume volume = volume_of_coefficients(random_samples(210, static_cast<unsigned>(degree)), {6, 5, 7}, degree);
    const auto first_root = cell_intersector(degree, Method::exact).first_root;
    std::mt19937 random(17);
    std::uniform_real_distribution<double> threshold(-0.4, 0.4);
    int found = 0;
    for (int repetition = 0; repetition < 20000; ++repetition) {
        const VolumeCell cell(volume, threshold(random), glm::ivec3(random() % 4, random() % 4, random() % 4));
        const LatticeRay ray(random_ray(random, cell.lower), volume.cell_shape());
        const std::optional<RootInCell> root = first_root(cell, ray);
        if (!root)
            continue;
        ++found;
        const Block block = block_of(degree, cell);
        REQUIRE(block.cells == 1);
        const glm::dvec3 normal(block.slab_normal[0][0], block.slab_normal[1][0], block.slab_normal[2][0]);
        const double along = glm::dot(normal, ray.at(root->t) - cell.lower);
        REQUIRE(along >= block.slab_lower[0]); // rounded outwards
        REQUIRE(along <= block.slab_upper[0]);
    }
    REQUIRE(found > 2000);
}

TEST_CASE("the slab of a cell is no thicker than its Bernstein coefficients require", "[brick]")
{
    // f = x + a x^2 + a y^2 about the middle of the cell, as samples of degree 2: c = f - a/2, as the second derivative
    // is 2a along both axes and c is f less an eighth of each. The Bernstein coefficients of a x^2 are a/4, -a/4, a/4.
    const float a = 0.2f;
    std::vector<float> samples;
    for (int z = 0; z < 3; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x)
                samples.push_back(static_cast<float>(x) + a * static_cast<float>(x * x + y * y) - 0.5f * a);
    const Volume volume = volume_of_coefficients(samples, {3, 3, 3}, 2);
    for_each_target([&] {
        const Block block = block_of(2, VolumeCell(volume, -volume.offset(), glm::ivec3(1)));
        REQUIRE(block.slab_normal[0][0] == 31);
        REQUIRE(block.slab_normal[1][0] == 0);
        REQUIRE(block.slab_normal[2][0] == 0);
        // f - x is between -a/2 and a/2: x between 0.5 - a/2 and 0.5 + a/2, times 31, rounded outwards.
        REQUIRE(block.slab_lower[0] == 12);
        REQUIRE(block.slab_upper[0] == 19);
    });
}

TEST_CASE("a cell that its slab does not reach is not in the block", "[brick]")
{
    // f = x about the middle of the cell: its coefficients have both signs at levels between -1 and 1, but the surface
    // is in the cell only at those between -1/2 and 1/2.
    std::vector<float> samples;
    for (int i = 0; i < 27; ++i)
        samples.push_back(static_cast<float>(i % 3) - 1.0f);
    const Volume volume = volume_of_coefficients(samples, {3, 3, 3}, 2);
    for_each_target([&] {
        const auto cells = [&](double level) {
            return block_of(2, VolumeCell(volume, level - volume.offset(), glm::ivec3(1))).cells;
        };
        REQUIRE(cells(0.9) == 0u);
        REQUIRE(cells(-0.9) == 0u);
        REQUIRE(cells(0.49) == 1u);
        REQUIRE(cells(-0.49) == 1u);
    });
}

TEST_CASE("the slabs of a block are those of its cells alone, on every SIMD target", "[brick]")
{
    const int degree = GENERATE(1, 2, 3);
    const Volume volume = volume_of_coefficients(random_samples(210, static_cast<unsigned>(degree)), {6, 5, 7}, degree);
    for_each_target([&] {
        std::mt19937 random(37);
        for (int repetition = 0; repetition < 200; ++repetition) {
            const glm::ivec3 corner(random() % 2, random() % 2, random() % 2);
            const unsigned cells = random() & 0xffu;
            const Block block = make_block(VolumeCell(volume, 0.1, corner), degree, 0.1, cells);
            for (std::size_t i = 0; i < 8; ++i) {
                if ((cells >> i & 1u) == 0) {
                    REQUIRE((block.cells >> i & 1u) == 0);
                    continue;
                }
                const glm::ivec3 cell = corner + glm::ivec3(i & 1, i >> 1 & 1, i >> 2);
                const Block alone = block_of(degree, VolumeCell(volume, 0.1, cell));
                for (std::size_t axis = 0; axis < 3; ++axis)
                    REQUIRE(block.slab_normal[axis][i] == alone.slab_normal[axis][0]);
                REQUIRE(block.slab_lower[i] == alone.slab_lower[0]);
                REQUIRE(block.slab_upper[i] == alone.slab_upper[0]);
                REQUIRE((block.cells >> i & 1u) == alone.cells);
            }
        }
    });
}
