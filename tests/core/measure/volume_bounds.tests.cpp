#include "isospline/measure/volume_bounds.h"

#include "catch.h"

#include "isospline/spline/degree.h"

#include <algorithm>
#include <cmath>
#include <random>

using namespace isospline;

namespace {

/// The part of the unit cube in which a function is at least 0, by a grid of midpoints.
template <typename Function>
double counted_volume(const Function& f, int steps)
{
    int count = 0;
    for (int k = 0; k < steps; ++k)
        for (int j = 0; j < steps; ++j)
            for (int i = 0; i < steps; ++i)
                count += f((glm::dvec3(i, j, k) + 0.5) / static_cast<double>(steps)) >= 0.0;
    return count / (static_cast<double>(steps) * steps * steps);
}

template <int Degree>
double value_at(BernsteinBox<Degree> b, const glm::dvec3& x)
{
    for (int axis = 0; axis < 3; ++axis)
        map_rows<Degree>(b, axis, [&](Bernstein<Degree>& row) {
            for (int left = Degree; left > 0; --left)
                for (int i = 0; i < left; ++i)
                    row[i] += x[axis] * (row[i + 1] - row[i]);
            row.fill(row[0]);
        });
    return b[0];
}

} // namespace

TEST_CASE("the volume below a plane is that of the points below it", "[measure]")
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> power(-3.0, 0.0), place(-0.1, 1.1);
    for (int i = 0; i < 200; ++i) {
        std::array<double, 3> s{std::pow(10.0, power(random)), std::pow(10.0, power(random)), 1.0};
        std::sort(s.begin(), s.end());
        const glm::dvec3 slope(s[0], s[1], s[2]);
        const double limit = place(random) * (s[0] + s[1] + s[2]);
        const double counted = counted_volume([&](const glm::dvec3& x) { return limit - glm::dot(slope, x); }, 40);
        // The plane crosses at most a layer of 40 x 40 small cubes two high, each half wrong on average.
        REQUIRE(std::abs(volume_below_plane(slope, limit) - (counted)) < 0.026);
    }
    // A corner tetrahedron and its complement, half of the cube, a slab, and the mean over x of (limit - x / 1000)^2
    // / 2.
    REQUIRE(std::abs(volume_below_plane({1.0, 1.0, 1.0}, 0.5) - (0.125 / 6.0)) < 1e-15);
    REQUIRE(std::abs(volume_below_plane({1.0, 1.0, 1.0}, 1.5) - (0.5)) < 1e-15);
    REQUIRE(std::abs(volume_below_plane({1.0, 1.0, 1.0}, 2.5) - (1.0 - 0.125 / 6.0)) < 1e-15);
    REQUIRE(std::abs(volume_below_plane({1e-3, 1e-3, 1.0}, 0.25) - (0.249)) < 1e-12);
    REQUIRE(std::abs(volume_below_plane({1e-3, 1.0, 1.0}, 0.5) - (0.12475 + 1e-6 / 6.0)) < 1e-12);
}

TEST_CASE("bounds of the volume in a cell contain it, and smaller parts of the cell tighten them", "[measure]")
{
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (const int degree : {1, 2, 3})
        dispatch_degree(degree, [&](auto of_degree) {
            constexpr int n = of_degree;
            double widths[4] = {};
            for (int i = 0; i < 60; ++i) {
                // From nearly linear ones to noise, some of them along an axis.
                const double noise = std::pow(10.0, -3.0 + 0.05 * i), sign = i % 2 == 0 ? 1.0 : -1.0;
                glm::dvec3 slope(normal(random), normal(random), normal(random));
                if (i % 3 == 0)
                    slope.x = slope.z = 0.0;
                const double constant = 0.3 * normal(random);
                BernsteinBox<n> b;
                for (int z = 0; z <= n; ++z)
                    for (int y = 0; y <= n; ++y)
                        for (int x = 0; x <= n; ++x)
                            b[bernstein_item<n>(x, y, z)] =
                                constant + glm::dot(slope, glm::dvec3(x, y, z) / static_cast<double>(n) - 0.5) +
                                noise * normal(random);
                constexpr int steps = 20;
                const double counted =
                    counted_volume([&](const glm::dvec3& x) { return sign * value_at<n>(b, x); }, steps);
                for (int depth = 0; depth < 4; ++depth) {
                    const auto [least, most] = volume_bounds<n>(b, sign, depth);
                    CAPTURE(degree, i, depth);
                    REQUIRE(0.0 <= least);
                    REQUIRE(least <= most);
                    REQUIRE(most <= 1.0);
                    REQUIRE(least <= counted + 0.03); // the grid's own error
                    REQUIRE(counted <= most + 0.03);
                    widths[depth] += most - least;
                }
            }
            for (int depth = 1; depth < 4; ++depth)
                REQUIRE(widths[depth] < 0.7 * widths[depth - 1]);
        });
}
