#include "isospline/trace/certified_placement.h"

#include "isospline/shell/isosurface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace isospline::certified {

namespace {

using Rows = std::array<std::array<Enclosure, 3>, 3>;

/// The inverse by cofactors; its numbers are unbounded if the determinant may be zero.
Rows inverse(const Rows& m)
{
    Rows cofactors;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            const std::size_t i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            cofactors[i][j] = m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1];
        }
    const Enclosure over_determinant = inverse(dot(m[0], cofactors[0]));
    Rows result;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            result[i][j] = cofactors[j][i] * over_determinant;
    return result;
}

/// Row i of a matrix of GLM, without the translation.
std::array<Enclosure, 3> row(const glm::dmat4& map, int i)
{
    return {map[0][i], map[1][i], map[2][i]};
}

std::array<Enclosure, 3> column(const glm::dmat4& map, int j)
{
    return {map[j][0], map[j][1], map[j][2]};
}

} // namespace

Placement::Placement(const IsosurfaceSnapshot& surface, const glm::dmat4& transform)
{
    // From index space to the space of the rays, and back.
    const glm::dmat4& index_to_world = surface.volume().index_to_world();
    Rows to_rays;
    for (int i = 0; i < 3; ++i) {
        const auto at = static_cast<std::size_t>(i);
        for (int j = 0; j < 3; ++j)
            to_rays[at][static_cast<std::size_t>(j)] = dot(row(transform, i), column(index_to_world, j));
        origin[at] = dot(row(transform, i), column(index_to_world, 3)) + transform[3][i];
    }
    to_lattice = inverse(to_rays);

    // Partial derivatives are means of differences of neighbouring coefficients.
    const BrickRanges::Range& range = surface.shared_ranges()->whole();
    slope = (Enclosure(range.upper) - static_cast<double>(range.lower)).upper();
    threshold_error = (Enclosure(surface.level()) - surface.volume().offset()).radius;
    coefficient_error = surface.volume().coefficient_error();
    for (std::size_t i = 0; i < 3; ++i) {
        origin_error[i] = 0x1p-900;
        for (std::size_t j = 0; j < 3; ++j) {
            const Enclosure& entry = to_lattice[i][j];
            const double magnitude = (std::abs(entry.value) + entry.radius) * (1.0 + 0x1p-40);
            product_error[i][j] = (0x1p-50 * magnitude + entry.radius) * (1.0 + 0x1p-40);
            origin_error[i] += magnitude * origin[j].radius * (1.0 + 0x1p-40);
        }
    }
    along_error = longest_edge = 0.0;
    for (std::size_t j = 0; j < 3; ++j) {
        double edge = 0.0;
        for (std::size_t i = 0; i < 3; ++i) {
            edge += std::abs(to_rays[i][j].value) + to_rays[i][j].radius;
            along_error += 0x1p-50 * std::abs(to_lattice[i][j].value) + to_lattice[i][j].radius;
        }
        longest_edge = std::max(longest_edge, edge * (1.0 + 0x1p-48));
    }
}

} // namespace isospline::certified
