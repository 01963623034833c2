#include "catch.h"

#include "each_target.h"
#include "level_bricks.h"
#include "volumes.h"

#include "isospline/shell/shell.h"
#include "isospline/spline/basis.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <cstddef>
#include <tuple>
#include <vector>

using namespace isospline;

namespace {

/// Coefficients of one cell, less the threshold, in float64: `side`^3 of them.
struct CellCoefficients {
    int side;
    std::vector<double> values;

    double at(int x, int y, int z) const { return values[static_cast<std::size_t>(x + side * (y + side * z))]; }

    bool has_both_signs() const
    {
        const auto below = std::count_if(values.begin(), values.end(), [](double c) { return c < 0.0; });
        return below != 0 && below != static_cast<std::ptrdiff_t>(values.size());
    }
};

CellCoefficients coefficients_of(const Volume& volume, const glm::ivec3& cell, double threshold)
{
    const float* first = volume.cell_coefficients(cell.x, cell.y, cell.z);
    CellCoefficients coefficients{volume.degree() + 1, {}};
    for (int z = 0; z <= volume.degree(); ++z)
        for (int y = 0; y <= volume.degree(); ++y)
            for (int x = 0; x <= volume.degree(); ++x)
                coefficients.values.push_back(first[x + y * volume.row_stride() + z * volume.slice_stride()] -
                                              threshold);
    return coefficients;
}

/// All fine coefficients by the sum that defines them, along the three axes at once.
template <int Degree>
CellCoefficients subdivide(const CellCoefficients& coarse)
{
    constexpr auto weights = two_scale_weights<Degree, double>();
    const auto weight = [&](int i) { return i < 0 || i > Degree + 1 ? 0.0 : weights[static_cast<std::size_t>(i)]; };
    CellCoefficients fine{2 * (coarse.side - Degree) + Degree, {}};
    for (int z = 0; z < fine.side; ++z)
        for (int y = 0; y < fine.side; ++y)
            for (int x = 0; x < fine.side; ++x) {
                double sum = 0.0;
                for (int k = 0; k < coarse.side; ++k)
                    for (int j = 0; j < coarse.side; ++j)
                        for (int i = 0; i < coarse.side; ++i)
                            sum += coarse.at(i, j, k) * weight(x + Degree - 2 * i) * weight(y + Degree - 2 * j) *
                                   weight(z + Degree - 2 * k);
                fine.values.push_back(sum);
            }
    return fine;
}

template <int Degree>
bool is_in_shell(const Volume& volume, const glm::ivec3& cell, double threshold, int depth)
{
    CellCoefficients coefficients = coefficients_of(volume, cell, threshold);
    if (!coefficients.has_both_signs())
        return false;
    for (int level = 0; level < depth; ++level)
        coefficients = subdivide<Degree>(coefficients);
    return coefficients.has_both_signs();
}

Shell shell_of(const LevelBricks& level, int depth, bool prune_border = true)
{
    return Shell(*level.volume, level.bricks, {.prune_depth = depth, .prune_border = prune_border, .mask = {}});
}

/// The index of a cell of an octet: by brick, by block, by cell, each with x varying fastest.
int index_in_octet(const Cell& cell)
{
    const auto index = [&](int edge, int count) {
        const auto place = [&](int coordinate) { return coordinate / edge % count; };
        return place(cell.x) + count * (place(cell.y) + count * place(cell.z));
    };
    return 8 * (64 * index(8, 2) + index(2, 4)) + index(1, 2);
}

template <int Degree>
void compare_with_definition(const glm::ivec3& shape, int depth)
{
    const LevelBricks level(noise_volume(shape, Degree), 0.2);
    const Shell shell = shell_of(level, depth);

    std::vector<Cell> expected;
    const glm::ivec3 cells = level.volume->cell_shape();
    for (int z = 0; z < cells.z; ++z)
        for (int y = 0; y < cells.y; ++y)
            for (int x = 0; x < cells.x; ++x)
                if (is_in_shell<Degree>(*level.volume, {x, y, z}, level.bricks.threshold(), depth))
                    expected.push_back(
                        {static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(z)});
    std::sort(expected.begin(), expected.end(), [](const Cell& a, const Cell& b) {
        const auto place = [](const Cell& cell) {
            return std::tuple(cell.z / 16, cell.y / 16, cell.x / 16, index_in_octet(cell));
        };
        return place(a) < place(b);
    });
    REQUIRE(!expected.empty());
    REQUIRE(shell.count() == expected.size());
    REQUIRE((shell.cells() == expected));
}

} // namespace

TEST_CASE("the shell is that of the definition, in the order of octets, bricks and blocks", "[shell]")
{
    for (const auto& shape : {glm::ivec3(11, 9, 10), glm::ivec3(2, 17, 3), glm::ivec3(18, 3, 33)}) {
        for (int depth = 0; depth <= 2; ++depth)
            compare_with_definition<1>(shape, depth);
        for (int depth = 0; depth <= 2; ++depth)
            compare_with_definition<2>(shape, depth);
        for (int depth = 0; depth <= 1; ++depth)
            compare_with_definition<3>(shape, depth);
    }
}

TEST_CASE("with the paper's border rule the border is not pruned", "[shell]")
{
    const LevelBricks level(noise_volume({12, 17, 9}, 2), 0.1);
    const auto initial = shell_of(level, 0).cells(), pruned = shell_of(level, 2).cells(),
               paper = shell_of(level, 2, false).cells();
    std::vector<Cell> expected;
    for (const Cell& cell : initial) {
        const bool border = cell.x == 0 || cell.y == 0 || cell.z == 0 || cell.x == 11 || cell.y == 16 || cell.z == 8;
        if (border || std::find(pruned.begin(), pruned.end(), cell) != pruned.end())
            expected.push_back(cell);
    }
    REQUIRE((paper == expected));
    REQUIRE(pruned.size() < paper.size());
    REQUIRE(paper.size() < initial.size());
}

TEST_CASE("the shell is the same for any number of threads", "[shell][threads]")
{
    const auto volume = noise_volume({60, 50, 40}, 2);
    const auto cells = [&] { return shell_of(LevelBricks(volume, 0.3), 2).cells(); };
    const std::vector<Cell> many = cells();
    set_thread_count(1);
    const std::vector<Cell> one = cells();
    set_thread_count(0);
    REQUIRE((many == one));
}

TEST_CASE("the shell is the same for any SIMD target", "[shell]")
{
    for (int degree = 1; degree <= 3; ++degree) {
        const auto volume = noise_volume({13, 12, 11}, degree);
        for (int depth = 1; depth <= 4; ++depth) {
            const auto cells = [&] { return shell_of(LevelBricks(volume, 0.3), depth).cells(); };
            const std::vector<Cell> expected = cells();
            for_each_target([&] { CHECK((cells() == expected)); });
        }
    }
}

TEST_CASE("a threshold out of the ranges leaves no cell", "[shell]")
{
    const auto volume = noise_volume({9, 9, 9}, 3);
    REQUIRE(shell_of(LevelBricks(volume, 100.0), 2).count() == 0);
    REQUIRE(shell_of(LevelBricks(volume, -1e300), 2).count() == 0);
}
