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
#include <vector>

using namespace isospline;

namespace {

/// A ball in noise that is much smaller than the distance of most samples from the level.
std::shared_ptr<const Volume> ball_in(const glm::ivec3& shape, int degree)
{
    std::mt19937 random(3);
    std::uniform_real_distribution<float> noise(-0.1f, 0.1f);
    std::vector<float> samples;
    for (int z = 0; z < shape.z; ++z)
        for (int y = 0; y < shape.y; ++y)
            for (int x = 0; x < shape.x; ++x)
                samples.push_back((x * x + y * y + z * z < 900 ? 1.0f : -1.0f) + noise(random));
    VolumeOptions options;
    options.degree = degree;
    return make_volume(samples, shape, options);
}

} // namespace

TEST_CASE("f is on one side of the level in the cubes of a side grid", "[brick]")
{
    const int degree = GENERATE(1, 2, 3);
    const auto volume = ball_in({131, 37, 70}, degree);
    const BrickRanges ranges(*volume);
    const double level = 0.2;
    const SideGrid grid(ranges, volume->cell_shape(), level - volume->offset());
    REQUIRE(grid.edge() == 2);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::set<int> edges;
    for (std::uint64_t i = 0; i < place_count(grid.shape()); ++i) {
        const int number = grid.numbers()[i], edge = std::abs(number);
        edges.insert(edge);
        if (number == 0)
            continue;
        const glm::ivec3 first = grid.edge() * at_place(grid.shape(), i) / edge * edge;
        const glm::dvec3 size = glm::min(glm::ivec3(edge), volume->cell_shape() - first);
        for (int sample = 0; sample < 4; ++sample) {
            const glm::dvec3 point = glm::dvec3(first) + size * glm::dvec3{unit(random), unit(random), unit(random)};
            const double beyond = volume->value(point - volume->lattice_shift()) - level;
            REQUIRE(beyond * number > std::abs(number) * 0.99 * grid.margin());
        }
    }
    REQUIRE(edges == std::set<int>{0, 2, 4, 8, 16, 32, 64});
}
