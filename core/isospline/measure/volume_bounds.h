// Bounds of the volume of a solid in one cell, without quadrature.
#pragma once

#include "isospline/brick/side.h"
#include "isospline/math/bernstein_box.h"
#include "isospline/measure/brick_solid.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>

namespace isospline {

/// The volume of the points x of the unit cube with <slope, x> <= limit; 0 < slope.x <= slope.y <= slope.z.
///
/// R. Scardovelli and S. Zaleski, "Analytical relations connecting linear interfaces and volume fractions in
/// rectangular grids", Journal of Computational Physics 164(1), 2000, section 2.2.
inline double volume_below_plane(const glm::dvec3& slope, double limit)
{
    const double sum = slope.x + slope.y + slope.z;
    if (limit <= 0.0)
        return 0.0;
    if (limit >= sum)
        return 1.0;
    if (limit > 0.5 * sum)
        return 1.0 - volume_below_plane(slope, sum - limit);
    const auto [x, y, z] = std::array{slope.x, slope.y, slope.z};
    const double six = 6.0 * x * y * z, both = x + y;
    const auto term = [limit](double edge) { return edge * edge * (edge - 3.0 * limit); };
    if (limit < x)
        return limit * limit * limit / six;
    if (limit < y)
        return (limit * (limit - x) + x * x / 3.0) / (2.0 * y * z);
    if (limit < std::min(both, z))
        return (limit * limit * (3.0 * both - limit) + term(x) + term(y)) / six;
    if (both <= z)
        return (limit - 0.5 * both) / z;
    return (limit * limit * (3.0 * sum - 2.0 * limit) + term(x) + term(y) + term(z)) / six;
}

/// Bounds of the part of a cell that is in the solid, given f - level on the cell; sign as in Solid.
///
/// The linear function that fits the coefficients best differs from f by no more than from the coefficients, because
/// linear functions are their own Bernstein coefficients. So the solid contains one half-space of the cell and is in
/// another one, parallel to it. The cell is halved `depth` times along each axis before.
template <int Degree>
Extremes<double> volume_bounds(const BernsteinBox<Degree>& b, double sign, int depth)
{
    const auto [least, most] = extremes_of(b);
    if (const Side side = side_of(least, most, sign); side != Side::unknown)
        return side == Side::inside ? Extremes<double>{1.0, 1.0} : Extremes<double>{0.0, 0.0};
    if (depth > 0) {
        Extremes<double> sum{0.0, 0.0};
        for (const bool upper_x : {false, true}) {
            const auto along_x = half_of<Degree>(b, 0, upper_x);
            for (const bool upper_y : {false, true}) {
                const auto along_y = half_of<Degree>(along_x, 1, upper_y);
                for (const bool upper_z : {false, true}) {
                    const auto part = volume_bounds<Degree>(half_of<Degree>(along_y, 2, upper_z), sign, depth - 1);
                    sum.least += 0.125 * part.least;
                    sum.most += 0.125 * part.most;
                }
            }
        }
        return sum;
    }

    // The slopes of a linear function through the means of the coefficients on the faces.
    glm::dvec3 slope(0.0);
    double mean = 0.0;
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j) {
            const double* const row = &b[bernstein_item<Degree>(0, j, k)];
            double sum = 0.0;
            for (int i = 0; i <= Degree; ++i)
                sum += row[i];
            mean += sum;
            slope.x += row[Degree] - row[0];
            slope.y += j == Degree ? sum : j == 0 ? -sum : 0.0;
            slope.z += k == Degree ? sum : k == 0 ? -sum : 0.0;
        }
    constexpr int count = Degree + 1;
    slope *= sign / (count * count);
    mean *= sign / (count * count * count);
    // Slopes near zero are made larger, so that the formula for the volume does not cancel; that counts as difference.
    const glm::dvec3 steep = glm::abs(slope);
    const glm::dvec3 taken = glm::max(steep, 1e-3 * std::max({steep.x, steep.y, steep.z}) + 1e-300);
    slope = glm::mix(taken, -taken, glm::lessThan(slope, glm::dvec3(0.0)));
    const double at_origin = mean - 0.5 * (slope.x + slope.y + slope.z);
    const glm::dvec3 step = slope / static_cast<double>(Degree);
    double below = 0.0, above = 0.0;
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j)
            for (int i = 0; i <= Degree; ++i) {
                const double difference =
                    sign * b[bernstein_item<Degree>(i, j, k)] - (at_origin + step.x * i + step.y * j + step.z * k);
                below = difference < below ? difference : below;
                above = difference > above ? difference : above;
            }

    // In the cube whose axes point towards higher values, the linear function is its value at the origin plus
    // <taken, x>, and the solid is where it is positive: upwards of a plane, or downwards from the opposite corner.
    std::array<double, 3> sorted{taken.x, taken.y, taken.z};
    std::sort(sorted.begin(), sorted.end());
    const glm::dvec3 ascending(sorted[0], sorted[1], sorted[2]);
    const double at_highest = mean + 0.5 * (ascending.x + ascending.y + ascending.z);
    return {volume_below_plane(ascending, at_highest + below), volume_below_plane(ascending, at_highest + above)};
}

} // namespace isospline
