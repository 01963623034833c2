#include "catch.h"

#include "isospline/trace/cell_intersector.h"
#include "isospline/trace/tight_box.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <random>
#include <string>
#include <vector>

using namespace isospline;

namespace {

/// A volume whose coefficients are the given samples.
Volume volume_of_coefficients(const std::vector<float>& samples, glm::ivec3 shape, int degree)
{
    VolumeOptions options;
    options.degree = degree;
    options.filter = Filter::none;
    const std::ptrdiff_t size = sizeof(float);
    return Volume({samples.data(), SampleType::float32, shape, {size, size * shape.x, size * shape.x * shape.y}},
                  options);
}

std::vector<float> random_samples(std::size_t count, unsigned seed)
{
    std::mt19937 random(seed);
    std::normal_distribution<float> value;
    std::vector<float> samples(count);
    for (float& sample : samples)
        sample = value(random);
    return samples;
}

double value(const Volume& volume, const CellBlock& cell, const LatticeRay& ray, double t)
{
    const glm::dvec3 local = ray.at(t) - cell.lower;
    switch (volume.degree()) {
    case 1:
        return value_in_cell<1>(cell, local);
    case 2:
        return value_in_cell<2>(cell, local);
    default:
        return value_in_cell<3>(cell, local);
    }
}

/// Rays of many kinds at the unit cube at `lower`: through two random points near it, along axes, from inside.
Ray random_ray(std::mt19937& random, const glm::dvec3& lower)
{
    std::uniform_real_distribution<double> near_cell(-0.3, 1.3), within(0.0, 1.0);
    std::uniform_int_distribution<int> kind(0, 4), axis(0, 2);
    const glm::dvec3 a(near_cell(random), near_cell(random), near_cell(random));
    const glm::dvec3 b(within(random), within(random), within(random));
    Ray ray;
    ray.direction = b - a;
    ray.origin = lower + a - 3.0 * ray.direction;
    switch (kind(random)) {
    case 0: // along an axis
        ray.direction = glm::dvec3(0.0);
        ray.direction[axis(random)] = 1.0;
        ray.origin = lower + b - 3.0 * ray.direction;
        break;
    case 1: // in a plane of two axes
        ray.direction[axis(random)] = 0.0;
        ray.origin = lower + b - 3.0 * ray.direction;
        break;
    case 2: // begins inside
        ray.origin = lower + b;
        break;
    }
    return ray;
}

} // namespace

TEST_CASE("exact and reference find the first crossing of random cells", "[trace]")
{
    const int degree = GENERATE(1, 2, 3);
    const glm::ivec3 shape(6, 5, 7);
    const Volume volume = volume_of_coefficients(random_samples(210, static_cast<unsigned>(degree)), shape, degree);
    const CellIntersector exact = cell_intersector(degree, Method::exact);
    const CellIntersector reference = cell_intersector(degree, Method::reference);

    std::mt19937 random(17);
    std::uniform_real_distribution<double> threshold(-0.4, 0.4);
    const glm::ivec3 cells = volume.cell_shape();
    int found = 0;
    for (int repetition = 0; repetition < 20000; ++repetition) {
        const Cell index{static_cast<std::uint16_t>(random() % static_cast<unsigned>(cells.x)),
                         static_cast<std::uint16_t>(random() % static_cast<unsigned>(cells.y)),
                         static_cast<std::uint16_t>(random() % static_cast<unsigned>(cells.z))};
        const CellBlock cell(volume, threshold(random), index);
        const LatticeRay ray(random_ray(random, cell.lower));
        const std::optional<double> t = exact(cell, ray);
        const std::optional<double> t_reference = reference(cell, ray);
        REQUIRE(t.has_value() == t_reference.has_value());
        if (t)
            REQUIRE(*t == Approx(*t_reference).margin(1e-9));

        // No change of sign before the root, by dense sampling; and a residual of nothing at the root.
        const Interval inside = ray.inside_cell(cell.lower);
        if (inside.t_near > inside.t_far)
            continue;
        const double end = t ? *t : inside.t_far;
        const bool negative = value(volume, cell, ray, inside.t_near) < 0.0;
        constexpr int samples = 200;
        for (int i = 1; i < samples; ++i) {
            const double t_sample = inside.t_near + (end - inside.t_near) * i / samples;
            const double f = value(volume, cell, ray, t_sample);
            if (std::abs(f) > 1e-9)
                REQUIRE((f < 0.0) == negative);
        }
        if (t) {
            ++found;
            // The hit is in the tight box, up to the margin that cells have.
            const Box box = degree == 1 ? tight_box<1>(cell) : degree == 2 ? tight_box<2>(cell) : tight_box<3>(cell);
            const glm::dvec3 position = ray.at(*t);
            for (int axis = 0; axis < 3; ++axis) {
                REQUIRE(position[axis] >= box.lower[axis] - 1e-8);
                REQUIRE(position[axis] <= box.upper[axis] + 1e-8);
            }
            REQUIRE(value(volume, cell, ray, *t) == Approx(0.0).margin(1e-10));
        }
    }
    REQUIRE(found > 2000);
}

TEST_CASE("the single precision filter is as sure for values far from zero and for tiny contrast", "[trace]")
{
    const int degree = GENERATE(1, 2, 3);
    const double base = GENERATE(0.0, 1000.0, -1e6);
    const double contrast = GENERATE(1e-3, 1.0);
    const glm::ivec3 shape(5, 5, 5);
    std::vector<float> samples = random_samples(125, 5);
    for (float& sample : samples)
        sample = static_cast<float>(base + contrast * static_cast<double>(sample));
    samples[0] = 0.0f; // keeps the volume's offset away from the base
    const Volume volume = volume_of_coefficients(samples, shape, degree);
    const CellIntersector exact = cell_intersector(degree, Method::exact);
    const CellIntersector reference = cell_intersector(degree, Method::reference);

    std::mt19937 random(3);
    std::uniform_real_distribution<double> level(-0.3, 0.3);
    for (int repetition = 0; repetition < 20000; ++repetition) {
        const CellBlock cell(volume, base + contrast * level(random) - volume.offset(), Cell{2, 2, 2});
        const LatticeRay ray(random_ray(random, cell.lower));
        const std::optional<double> t = exact(cell, ray), t_reference = reference(cell, ray);
        REQUIRE(t.has_value() == t_reference.has_value());
        if (t)
            REQUIRE(*t == Approx(*t_reference).margin(1e-7));
    }
}

TEST_CASE("two roots in one cell: exact finds the first, bracket finds none", "[trace]")
{
    // One coefficient of 1: f is the product of beta^2 of x, y, z, and along the x axis beta^2(x) (3/4)^2.
    std::vector<float> samples(27, 0.0f);
    samples[13] = 1.0f;
    const Volume volume = volume_of_coefficients(samples, {3, 3, 3}, 2);
    Ray ray;
    ray.origin = {-10.0, 1.5, 1.5};
    ray.direction = {2.0, 0.0, 0.0};

    // In the middle cell beta^2 = 3/4 - x^2, from 1/2 at its ends: never as low as 0.4.
    const CellBlock above(volume, 0.4 * 0.5625 - volume.offset(), Cell{1, 1, 1});
    REQUIRE_FALSE(cell_intersector(2, Method::exact)(above, LatticeRay(ray)));
    REQUIRE_FALSE(cell_intersector(2, Method::bracket)(above, LatticeRay(ray)));

    // It is 0.6 at |x| = sqrt(0.15), twice in the cell.
    const CellBlock pair(volume, 0.6 * 0.5625 - volume.offset(), Cell{1, 1, 1});
    const std::optional<double> first = cell_intersector(2, Method::exact)(pair, LatticeRay(ray));
    REQUIRE(first);
    REQUIRE(ray.at(*first).x == Approx(1.5 - std::sqrt(0.15)).margin(1e-7));
    REQUIRE_FALSE(cell_intersector(2, Method::bracket)(pair, LatticeRay(ray)));

    // Limits: beginning between the roots leaves the second; ending before the first leaves none.
    ray.t_near = *first + 1e-6;
    const std::optional<double> second = cell_intersector(2, Method::exact)(pair, LatticeRay(ray));
    REQUIRE(second);
    REQUIRE(ray.at(*second).x == Approx(1.5 + std::sqrt(0.15)).margin(1e-7));
    ray.t_near = 0.0;
    ray.t_far = *first - 1e-6;
    REQUIRE_FALSE(cell_intersector(2, Method::exact)(pair, LatticeRay(ray)));
}

TEST_CASE("a degree that has no surface is refused", "[trace]")
{
    REQUIRE_THROWS_AS(cell_intersector(0, Method::exact), std::invalid_argument);
    REQUIRE_THROWS_AS(cell_intersector(4, Method::exact), std::invalid_argument);
}
