#include "isospline/query/outline_cells.h"

#include "isospline/cell/coefficients.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace isospline {

namespace {

/// The products of rounded numbers are off by less than this part of the sum of their absolute values.
constexpr double rounding = 1e-12;

struct Range {
    double least, most;
};

/// The slopes of f along an axis in a cell: by convexity, they are within the differences of its coefficients.
Range slopes(const CellCoefficients& cell, int degree, int axis)
{
    Range range{1e300, -1e300};
    const glm::ivec3 step(axis == 0, axis == 1, axis == 2);
    for (int k = 0; k <= degree - step.z; ++k)
        for (int j = 0; j <= degree - step.y; ++j)
            for (int i = 0; i <= degree - step.x; ++i) {
                const double slope = cell(i + step.x, j + step.y, k + step.z) - cell(i, j, k);
                range.least = std::min(range.least, slope);
                range.most = std::max(range.most, slope);
            }
    return range;
}

bool may_be_tangent(const CellCoefficients& cell, int degree, const glm::dvec4& eye)
{
    double least = 0.0, most = 0.0, magnitude = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const Range slope = slopes(cell, degree, axis);
        const double first = eye.w * cell.lower[axis] - eye[axis], second = first + eye.w;
        const std::array<double, 4> products{slope.least * first, slope.most * first, slope.least * second,
                                             slope.most * second};
        least += *std::min_element(products.begin(), products.end());
        most += *std::max_element(products.begin(), products.end());
        for (const double product : products)
            magnitude += std::abs(product);
    }
    return least <= rounding * magnitude && most >= -rounding * magnitude;
}

} // namespace

std::vector<glm::ivec3> outline_cells(const IsosurfaceSnapshot& surface, const glm::dvec4& eye,
                                      const Progress& progress)
{
    const std::vector<Cell>& cells = surface.shell(progress).cells();
    const Volume& volume = surface.volume();
    std::vector<std::uint8_t> may_be(cells.size());
    parallel_for(cells.size(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            may_be[i] = may_be_tangent(VolumeCell(volume, surface.threshold(), cells[i]), volume.degree(), eye);
    });
    std::vector<glm::ivec3> found;
    for (std::size_t i = 0; i < cells.size(); ++i)
        if (may_be[i] != 0)
            found.emplace_back(cells[i]);
    return found;
}

} // namespace isospline
