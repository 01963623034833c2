// The part of a solid that is in a brick, by cells.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/cell/coefficients.h"
#include "isospline/math/bernstein_box.h"
#include "isospline/measure/solid.h"
#include "isospline/spline/cell_weights-inl.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace isospline {

/// The bit of a cell in its slice of a brick.
constexpr std::uint64_t bit_of(const glm::ivec3& cell)
{
    return std::uint64_t{1} << (cell.x + brick_size * cell.y);
}

/// The side of a cell by its B-spline coefficients.
template <int Degree>
Side side_of(const CellCoefficients& cell, double sign)
{
    // By column of a row, so that comparisons do not wait for each other.
    std::array<float, Degree + 1> least, most;
    std::copy_n(cell.row(0, 0), Degree + 1, least.begin());
    most = least;
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j) {
            const float* const row = cell.row(j, k);
            for (std::size_t i = 0; i <= Degree; ++i) {
                least[i] = row[i] < least[i] ? row[i] : least[i];
                most[i] = row[i] > most[i] ? row[i] : most[i];
            }
        }
    return side_of(*std::min_element(least.begin(), least.end()) - cell.threshold,
                   *std::max_element(most.begin(), most.end()) - cell.threshold, sign);
}

/// The Bernstein coefficients of f - level in a cell. Two cells that share a face have the same ones there, bit for
/// bit.
template <int Degree>
BernsteinBox<Degree> bernstein_of(const CellCoefficients& cell)
{
    BernsteinBox<Degree> b;
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j)
            for (int i = 0; i <= Degree; ++i)
                b[bernstein_item<Degree>(i, j, k)] = cell(i, j, k);
    for (int axis = 0; axis < 3; ++axis)
        map_rows<Degree>(b, axis, [](Bernstein<Degree>& row) { row = scalar::bernstein_of_bspline<Degree>(row); });
    return b;
}

/// The solid in a brick, within its clip. A cell that the clip only touches contains nothing of it.
struct BrickSolid {
    BrickCells cells{};                ///< cells that contain a part of it
    BrickCells certain{};              ///< those where it is more than points at which f may touch the level
    BrickCells inside{};               ///< cells that are completely in it, by their Bernstein coefficients
    std::array<BrickCells, 3> links{}; ///< cells that it leaves through their upper face, along x, y, z
};

BrickSolid solid_in(const Solid& solid, const Brick& brick);

} // namespace isospline
