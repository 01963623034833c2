#include "catch.h"

#include "noise_volume.h"

#include "isospline/shell/shell.h"
#include "isospline/shell/value_bounds.h"
#include "isospline/spline/basis.h"
#include "isospline/util/parallel.h"

#include <hwy/targets.h>

#include <algorithm>
#include <cstddef>
#include <stdexcept>
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

template <int Degree>
void compare_with_definition(const glm::ivec3& shape, int depth)
{
    const auto volume = noise_volume(shape, Degree);
    const ValueBounds bounds(*volume);
    const double threshold = 0.2;
    const Shell shell(*volume, bounds, threshold, {.prune_depth = depth, .prune_border = true, .mask = {}}, {});

    std::vector<Cell> expected;
    const glm::ivec3 cells = volume->cell_shape();
    const auto by_block = [](const Cell& a, const Cell& b) {
        return std::tuple(a.z / 2, a.y / 2, a.x / 2, a.z % 2, a.y % 2, a.x % 2) <
               std::tuple(b.z / 2, b.y / 2, b.x / 2, b.z % 2, b.y % 2, b.x % 2);
    };
    for (std::size_t index = 0; index < bounds.ranges().size(); ++index) {
        const Brick brick = brick_at(cells, index);
        const auto first_of_brick = static_cast<std::ptrdiff_t>(expected.size());
        for (int z = 0; z < brick.size.z; ++z)
            for (int y = 0; y < brick.size.y; ++y)
                for (int x = 0; x < brick.size.x; ++x) {
                    const glm::ivec3 cell = brick.first + glm::ivec3(x, y, z);
                    if (is_in_shell<Degree>(*volume, cell, threshold, depth))
                        expected.push_back({static_cast<std::uint16_t>(cell.x), static_cast<std::uint16_t>(cell.y),
                                            static_cast<std::uint16_t>(cell.z)});
                }
        std::sort(expected.begin() + first_of_brick, expected.end(), by_block);
    }
    REQUIRE(!expected.empty());
    REQUIRE(shell.count() == expected.size());
    REQUIRE((shell.cells() == expected));
}

} // namespace

TEST_CASE("the shell is that of the definition, in the order of bricks and blocks", "[shell]")
{
    for (const auto& shape : {glm::ivec3(11, 9, 10), glm::ivec3(2, 17, 3)}) {
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
    const auto volume = noise_volume({12, 17, 9}, 2);
    const ValueBounds bounds(*volume);
    const auto shell_of = [&](int depth, bool prune_border) {
        const ShellOptions options{.prune_depth = depth, .prune_border = prune_border, .mask = {}};
        return Shell(*volume, bounds, 0.1, options, {}).cells();
    };
    const auto initial = shell_of(0, true), pruned = shell_of(2, true), paper = shell_of(2, false);
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
    const ValueBounds bounds(*volume);
    const Shell many(*volume, bounds, 0.3, {}, {});
    set_thread_count(1);
    const Shell one(*volume, bounds, 0.3, {}, {});
    set_thread_count(0);
    REQUIRE((many.cells() == one.cells()));
}

TEST_CASE("the shell is the same for any SIMD target", "[shell]")
{
    for (int degree = 1; degree <= 3; ++degree) {
        const auto volume = noise_volume({13, 12, 11}, degree);
        const ValueBounds bounds(*volume);
        for (int depth = 1; depth <= 4; ++depth) {
            const ShellOptions options{.prune_depth = depth, .prune_border = true, .mask = {}};
            const auto shell = [&] { return Shell(*volume, bounds, 0.3, options, {}).cells(); };
            const auto expected = shell();
            for (auto targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
                const auto target = targets & -targets;
                hwy::SetSupportedTargetsForTest(target);
                hwy::GetChosenTarget().Update(hwy::SupportedTargets());
                INFO(hwy::TargetName(target));
                CHECK((shell() == expected));
                hwy::SetSupportedTargetsForTest(0);
                hwy::GetChosenTarget().Update(hwy::SupportedTargets());
            }
        }
    }
}

TEST_CASE("a threshold out of the bounds leaves no cell", "[shell]")
{
    const auto volume = noise_volume({9, 9, 9}, 3);
    const ValueBounds bounds(*volume);
    REQUIRE(Shell(*volume, bounds, 100.0, {}, {}).count() == 0);
    REQUIRE(Shell(*volume, bounds, -1e300, {}, {}).count() == 0);
}

TEST_CASE("the depth of pruning is checked", "[shell]")
{
    const auto volume = noise_volume({4, 4, 4}, 2);
    const ValueBounds bounds(*volume);
    for (const int depth : {-1, 7})
        REQUIRE_THROWS_AS(Shell(*volume, bounds, 0.0, {.prune_depth = depth, .prune_border = true, .mask = {}}, {}),
                          std::invalid_argument);
}
