#include "catch.h"
#include "volumes.h"

#include "isospline/cell/value-inl.h"
#include "isospline/math/brent.h"
#include "isospline/query/surface_box.h"

#include <algorithm>
#include <cmath>
#include <random>

using namespace isospline;

namespace {

template <int Degree>
double value_of(const SurfaceBox<Degree>& box, const glm::dvec3& t)
{
    const auto weights = [](double s) {
        std::array<double, Degree + 1> w{};
        for (int i = 0; i <= Degree; ++i)
            w[static_cast<std::size_t>(i)] =
                binomials<Degree>[static_cast<std::size_t>(i)] * std::pow(s, i) * std::pow(1.0 - s, Degree - i);
        return w;
    };
    const auto x = weights(t.x), y = weights(t.y), z = weights(t.z);
    double value = 0.0;
    for (std::size_t k = 0; k <= Degree; ++k)
        for (std::size_t j = 0; j <= Degree; ++j)
            for (std::size_t i = 0; i <= Degree; ++i)
                value += x[i] * y[j] * z[k] * box.b[i + (Degree + 1) * (j + (Degree + 1) * k)];
    return value;
}

/// A part of the cell, and a metric that shears it.
template <int Degree>
void check_boxes()
{
    const auto volume = noise_volume({7, 7, 7}, Degree);
    glm::dmat4 to_world(1.0);
    to_world[0] = {1.0, 0.2, 0.0, 0.0};
    to_world[1] = {-0.3, 1.5, 0.1, 0.0};
    to_world[2] = {0.2, 0.0, 0.6, 0.0};
    const LatticeMetric metric(to_world);
    std::mt19937 random(Degree);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    int surfaces = 0, small = 0;
    double gap = 0.0, gap_of_box = 0.0;
    for (int trial = 0; trial < 300; ++trial) {
        const VolumeCell cell(*volume, 0.05, glm::ivec3(1 + trial % 4, 1 + trial / 4 % 4, 2));
        SurfaceBox<Degree> box = surface_box<Degree>(cell, 0);
        for (int halving = 0; halving < trial % 13; ++halving) {
            const bool upper = unit(random) < 0.5;
            const auto half = half_of<Degree>(box, halving % 3, upper);
            box = half.has_surface() ? half : half_of<Degree>(box, halving % 3, !upper);
        }

        // The polynomial of the box is that of the cell.
        const glm::dvec3 t(unit(random), unit(random), unit(random));
        CHECK(std::abs(value_of<Degree>(box, t) - scalar::value_in_cell<Degree>(cell, box.lower + t * box.size)) <
              1e-14);

        // Points of the surface in it are in the slab, and not nearer than the bound.
        const glm::dvec3 point = 6.0 * glm::dvec3(unit(random), unit(random), unit(random)) - 2.5;
        const double bound = distance_bound<Degree>(box, metric, point);
        const UnitSlab slab = slab_of<Degree>(box);
        double nearest = 1e30;
        for (int line = 0; line < 400; ++line) {
            const glm::dvec3 a(unit(random), unit(random), unit(random)), b(unit(random), unit(random), unit(random));
            const auto along = [&](double s) { return value_of<Degree>(box, a + s * (b - a)); };
            const FunctionPoint first{0.0, along(0.0)}, last{1.0, along(1.0)};
            if ((first.value < 0.0) == (last.value < 0.0))
                continue;
            const glm::dvec3 root = a + brent_root(along, first, last, 1e-13) * (b - a);
            REQUIRE(box.has_surface());
            CHECK(glm::dot(slab.normal, root) >= slab.lower - 1e-12);
            CHECK(glm::dot(slab.normal, root) <= slab.upper + 1e-12);
            const double distance = metric.length(box.lower + root * box.size - point);
            CHECK(distance >= bound * (1.0 - 1e-12));
            CHECK(distance >= metric.distance_bound(point, {box.lower, box.lower + box.size}) * (1.0 - 1e-12));
            nearest = std::min(nearest, distance);
        }
        if (nearest == 1e30)
            continue;
        ++surfaces;
        if (std::max({box.size.x, box.size.y, box.size.z}) <= 0.125) {
            ++small;
            gap += nearest - bound;
            gap_of_box += nearest - metric.distance_bound(point, {box.lower, box.lower + box.size});
        }
    }
    CHECK(surfaces > 100);
    CHECK(small > 20);
    CHECK(gap < 0.5 * gap_of_box); // some of it being that of the sampling
}

} // namespace

TEST_CASE("No point of the surface in a part of a cell is nearer than its bound", "[query]")
{
    check_boxes<1>();
    check_boxes<2>();
    check_boxes<3>();
}

TEST_CASE("The least of a linear function over a slab of the cube is that of the corners of the polygon", "[query]")
{
    // x + y >= 1.5 at the cost (1, 2, -1): x goes first, z is free.
    CHECK(std::abs(least_over({{1, 1, 0}, 1.5, 9}, {1, 2, -1}) - 1.0) < 1e-15);
    CHECK(std::abs(least_over({{1, 1, 0}, -9, 0.5}, {-1, -2, 0}) + 1.0) < 1e-15);
    CHECK(std::isinf(least_over({{1, 1, 0}, 2.5, 9}, {1, 2, -1})));
}
