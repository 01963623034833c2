#include "catch.h"
#include "volumes.h"

#include "isospline/math/affine.h"
#include "isospline/query/reach.h"
#include "isospline/query/solid.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <random>
#include <vector>

using namespace isospline;

namespace {

std::vector<glm::dvec3> some_directions()
{
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::vector<glm::dvec3> directions{{1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
    for (int i = 0; i < 20; ++i)
        directions.emplace_back(normal(random), normal(random), normal(random));
    return directions;
}

/// The largest product of a direction with a corner of a cell of the shell.
double reach_of_cells(const IsosurfaceSnapshot& surface, const glm::dvec3& direction)
{
    double reach = -1e300;
    for (const Cell& cell : surface.shell().cells())
        for (int corner = 0; corner < 8; ++corner)
            reach = std::max(reach, glm::dot(direction, glm::dvec3(glm::ivec3(cell) + child_position(corner))));
    return reach;
}

} // namespace

TEST_CASE("the reach of a surface is that of its farthest cell", "[query][reach]")
{
    const std::vector<glm::dvec3> directions = some_directions();
    for (const int degree : {1, 2, 3}) {
        IsosurfaceOptions options;
        if (degree == 2)
            options.clip = {{{1.0, 0.3, 0.0}, 8.0}, {{-1.0, 0.0, 0.2}, -20.0}};
        const Isosurface surface(noise_volume({33, 29, 41}, degree), 0.3, options);
        const std::vector<double> reach = reach_lattice(*surface.snapshot(), directions);
        for (std::size_t i = 0; i < directions.size(); ++i)
            CHECK(std::abs(reach[i] - reach_of_cells(*surface.snapshot(), directions[i])) < 1e-9);
        const Box bounds = surface.snapshot()->bounds_lattice();
        CHECK(bounds.upper.x == reach[0]);
        CHECK(bounds.lower.y == -reach[1]);
        CHECK(bounds.upper.z == reach[2]);
    }
}

TEST_CASE("the reach of a capped surface holds its caps, and no more", "[query][reach]")
{
    const std::vector<glm::dvec3> directions = some_directions();
    std::mt19937 random(2);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    // At the lower level, almost all of the volume is solid, including corners of the box far from all cells of the
    // shell.
    const auto [level, is_masked] =
        GENERATE(table<double, bool>({{-2.5, false}, {0.4, false}, {-2.5, true}, {0.4, true}}));
    const auto volume = noise_volume({17, 15, 19}, 2);
    IsosurfaceOptions options;
    options.capped = true;
    options.clip = half_spaces({{-0.5, -0.5, -0.5}, {16.5, 14.5, 18.5}});
    options.clip.push_back({{1.0, 1.0, 1.0}, 6.0});
    if (is_masked) { // keeps a corner of the volume
        options.shell.mask.resize(17 * 15 * 19);
        for (int i = 0; i < 17 * 15 * 19; ++i)
            options.shell.mask[static_cast<std::size_t>(i)] = i % 17 < 6 && i / 17 % 15 > 8 && i / (17 * 15) < 11;
    }
    const Isosurface surface(volume, level, options);
    const auto snapshot = surface.snapshot();
    const std::vector<double> reach = reach_lattice(*snapshot, directions);
    std::vector<double> found(directions.size());
    for (std::size_t i = 0; i < directions.size(); ++i)
        found[i] = reach_of_cells(*snapshot, directions[i]);
    const glm::dvec3 shape(volume->cell_shape());
    for (int trial = 0; trial < 200000; ++trial) {
        glm::dvec3 point = glm::dvec3(unit(random), unit(random), unit(random)) * shape;
        const int axis = trial % 3;
        point[axis] = trial % 2 == 0 ? 0.0 : shape[axis];
        if (trial % 5 == 0) // an edge of the box
            point[(axis + 1) % 3] = trial % 4 < 2 ? 0.0 : shape[(axis + 1) % 3];
        if (trial % 25 == 0) // a corner
            point[(axis + 2) % 3] = trial % 8 < 4 ? 0.0 : shape[(axis + 2) % 3];
        if (!contains(*snapshot, transform_point(volume->lattice_to_world(), point)))
            continue;
        for (std::size_t i = 0; i < directions.size(); ++i) {
            const double along = glm::dot(directions[i], point);
            found[i] = std::max(found[i], along);
            if (along > reach[i] + 1e-9)
                FAIL("a cap beyond the reach");
        }
    }
    // With a mask, whole cells count.
    const double margin = is_masked ? 1.8 : 0.3;
    for (std::size_t i = 0; i < directions.size(); ++i)
        CHECK(reach[i] < found[i] + margin * glm::length(directions[i]));
    const Box bounds = bounds_lattice(*snapshot);
    CHECK(bounds.upper.x == reach[0]);
    CHECK(bounds.lower.y == -reach[1]);
    CHECK(bounds.upper.z == reach[2]);
}

TEST_CASE("coefficients above the level alone make no cap", "[query][reach]")
{
    // A block of 1 in a block of 0.5: the coefficients at the border of the outer block exceed 0.65, the values do not.
    const glm::ivec3 shape(30);
    std::vector<float> samples;
    for (int z = 0; z < shape.z; ++z)
        for (int y = 0; y < shape.y; ++y)
            for (int x = 0; x < shape.x; ++x) {
                const bool is_inner = x >= 12 && x < 18 && y >= 12 && y < 18;
                const bool is_outer = x >= 4 && x < 26 && y >= 4 && y < 26;
                samples.push_back(is_inner ? 1.0f : is_outer ? 0.5f : 0.0f);
            }
    const auto volume = make_volume(samples, shape);
    IsosurfaceOptions options;
    options.capped = true;
    options.clip = {{{0.0, 0.0, 1.0}, 14.2}};
    options.shell.mask.assign(samples.size(), true);
    options.shell.mask[0] = false;
    const Isosurface surface(volume, 0.65, options);
    const Box bounds = bounds_lattice(*surface.snapshot());
    CHECK(bounds.lower.x > 10.0);
    CHECK(bounds.upper.y < 20.0);
}
