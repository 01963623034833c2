#include "catch.h"

#include "isospline/cell/bracket-inl.h"
#include "isospline/cell/intersector.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

using namespace isospline;

namespace {

/// A volume of 4 x 4 x 4 coefficients, given as a function of x, y, z.
template <typename Function>
Volume volume_of_coefficients(int degree, const Function& f)
{
    std::vector<float> samples;
    for (int z = 0; z < 4; ++z)
        for (int y = 0; y < 4; ++y)
            for (int x = 0; x < 4; ++x)
                samples.push_back(static_cast<float>(f(x, y, z)));
    VolumeOptions options;
    options.degree = degree;
    options.filter = Filter::none;
    return Volume({samples.data(), SampleType::float32, {4, 4, 4}, {4, 16, 64}}, options);
}

} // namespace

TEST_CASE("bracket finds a plane where it is", "[cell]")
{
    // Splines of every degree reproduce x; the lattice coordinate of index x is x + lattice_shift.
    const int degree = GENERATE(1, 2, 3);
    const Volume volume = volume_of_coefficients(degree, [](int x, int, int) { return x; });
    const VolumeCell cell(volume, 1.3 - volume.offset(), glm::ivec3(1));
    const double plane = 1.3 + volume.lattice_shift();
    const auto intersect = cell_intersector(degree, Method::bracket).first_root;

    Ray ray{{-5.0, 1.25, 1.75}, {2.0, 0.0, 0.0}};
    std::optional<RootInCell> root = intersect(cell, LatticeRay(ray, volume.cell_shape()));
    REQUIRE(root);
    REQUIRE(ray.at(root->t).x == Approx(plane).margin(1e-11));

    ray = {{4.0, 1.25, 1.75}, {-1.0, 0.05, -0.05}};
    root = intersect(cell, LatticeRay(ray, volume.cell_shape()));
    REQUIRE(root);
    REQUIRE(root->gradient.x == Approx(1.0));
    REQUIRE(ray.at(root->t).x == Approx(plane).margin(1e-11));

    // Limits on both sides of the plane, a ray beside the cell, and one parallel to the plane.
    ray.t_far = root->t - 1e-6;
    REQUIRE_FALSE(intersect(cell, LatticeRay(ray, volume.cell_shape())));
    ray.t_far = 100.0;
    ray.t_near = root->t + 1e-6;
    REQUIRE_FALSE(intersect(cell, LatticeRay(ray, volume.cell_shape())));
    REQUIRE_FALSE(intersect(cell, LatticeRay({{-5.0, 2.5, 1.5}, {1.0, 0.0, 0.0}}, volume.cell_shape())));
    REQUIRE_FALSE(intersect(cell, LatticeRay({{plane + 0.1, -5.0, 1.5}, {0.0, 1.0, 0.0}}, volume.cell_shape())));
}

TEST_CASE("bracket accepts a root at the very end of a ray", "[cell]")
{
    // f1 f2 <= 0 with f1 = 0. At degree 1 the value at lattice x = 3/2 is exact.
    const Volume volume = volume_of_coefficients(1, [](int x, int, int) { return x; });
    const VolumeCell cell(volume, 1.5 - volume.offset(), glm::ivec3(1));
    Ray ray{{1.5, 1.5, 1.5}, {1.0, 0.0, 0.0}};
    REQUIRE(scalar::bracket_first_root<1>(cell, LatticeRay(ray, volume.cell_shape()))->t == 0.0);
    ray = {{1.0, 1.5, 1.5}, {1.0, 0.0, 0.0}, 0.0, 0.5};
    REQUIRE(scalar::bracket_first_root<1>(cell, LatticeRay(ray, volume.cell_shape()))->t == 0.5);
}

TEST_CASE("bracket finds a root if and only if their number is odd, the first one if there is one", "[cell]")
{
    const int degree = GENERATE(1, 2, 3);
    std::mt19937 random(11);
    std::normal_distribution<double> coefficient;
    std::uniform_real_distribution<double> within(0.0, 1.0);
    const auto bracket = cell_intersector(degree, Method::bracket).first_root;
    const auto reference = cell_intersector(degree, Method::reference).first_root;

    int odd = 0, missed = 0;
    for (int repetition = 0; repetition < 2000; ++repetition) {
        const Volume volume = volume_of_coefficients(degree, [&](int, int, int) { return coefficient(random); });
        const VolumeCell cell(volume, -volume.offset(), glm::ivec3(1));
        const glm::dvec3 a(within(random), within(random), 0.0), b(within(random), within(random), 1.0);
        Ray ray{cell.lower + a - 2.0 * (b - a), b - a};

        // All roots, by the reference, beginning again behind each.
        std::vector<double> roots;
        while (const auto root = reference(cell, LatticeRay(ray, volume.cell_shape()))) {
            roots.push_back(root->t);
            ray.t_near = root->t + 1e-9;
        }
        ray.t_near = 0.0;
        const auto found = bracket(cell, LatticeRay(ray, volume.cell_shape()));
        REQUIRE(found.has_value() == (roots.size() % 2 == 1));
        odd += found.has_value();
        missed += !found && !roots.empty();
        if (!found)
            continue;
        double nearest = 1.0;
        for (const double root : roots)
            nearest = std::min(nearest, std::abs(found->t - root));
        REQUIRE(nearest < 1e-8);
        if (roots.size() == 1)
            REQUIRE(found->t == Approx(roots[0]).margin(1e-8));
    }
    REQUIRE(odd > 500);
    REQUIRE(missed > 3);
}
