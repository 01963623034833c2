#include "catch.h"
#include "volumes.h"

#include "isospline/brick/side_grid.h"
#include "isospline/math/grid.h"

#include <glm/common.hpp>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <random>
#include <set>

using namespace isospline;

namespace {

/// A ball in noise that is much smaller than the distance of most samples from the level.
std::shared_ptr<const Volume> ball_in(const glm::ivec3& shape, int degree)
{
    std::mt19937 random(3);
    std::uniform_real_distribution<float> noise(-0.1f, 0.1f);
    VolumeOptions options;
    options.degree = degree;
    const auto sample = [&](int x, int y, int z) {
        return (x * x + y * y + z * z < 900 ? 1.0f : -1.0f) + noise(random);
    };
    return sampled_volume(sample, shape, options);
}

/// The distance to the nearest block with 0, by looking at all that may be nearer.
int distance_in(const SideGrid& grid, const glm::ivec3& block)
{
    for (int distance = 0; distance < SideGrid::farthest; ++distance) {
        const glm::ivec3 first = glm::max(block - distance, glm::ivec3(0));
        const glm::ivec3 last = glm::min(block + distance, grid.shape() - 1);
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x)
                    if (grid.numbers()[place_in(grid.shape(), {x, y, z})] == 0)
                        return distance;
    }
    return SideGrid::farthest;
}

} // namespace

TEST_CASE("f is on one side of the level around the blocks of a side grid", "[brick]")
{
    const int degree = GENERATE(1, 2, 3);
    const auto volume = ball_in({131, 37, 70}, degree);
    const BrickRanges ranges(*volume);
    const double level = 0.2;
    const SideGrid grid(ranges, volume->cell_shape(), level - volume->offset());
    REQUIRE(grid.edge() == 2);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::set<int> distances;
    for (std::uint64_t i = 0; i < place_count(grid.shape()); ++i) {
        const int number = grid.numbers()[i], distance = std::abs(number);
        distances.insert(distance);
        REQUIRE(distance == distance_in(grid, at_place(grid.shape(), i)));
        const glm::ivec3 block = at_place(grid.shape(), i);
        const glm::dvec3 first = glm::max(2 * (block + 1 - distance), glm::ivec3(0));
        const glm::dvec3 last = glm::min(2 * (block + distance), volume->cell_shape());
        for (int sample = 0; number != 0 && sample < 4; ++sample) {
            const glm::dvec3 point = first + (last - first) * glm::dvec3{unit(random), unit(random), unit(random)};
            const double beyond = volume->value(point - volume->lattice_shift()) - level;
            REQUIRE(beyond * number > distance * 0.99 * grid.margin());
        }
    }
    REQUIRE(distances.size() == 17);
}
