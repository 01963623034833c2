// Points given from Python.
#pragma once

#include "arrays.h"

#include "isospline/math/affine.h"
#include "isospline/math/grid.h"
#include "isospline/spline/volume.h"
#include "isospline/util/check.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

namespace isospline {

/// Throws if a point is not finite.
inline void check_points(const RowArray& points)
{
    for (std::size_t row = 0; row < points.count(); ++row)
        if (const glm::dvec3 point = points.vector(row); !is_finite(point))
            throw_invalid("points", "finite numbers", to_text(point) + " in point " + std::to_string(row));
}

/// Throws if squares of distances could be infinite.
inline void check_reach(const RowArray& points)
{
    constexpr double largest = 1e100;
    for (std::size_t row = 0; row < points.count(); ++row)
        for (std::size_t axis = 0; axis < 3; ++axis)
            if (std::abs(points(row, axis)) > largest)
                throw_invalid("points", "coordinates of at most 1e100",
                              to_text(points.vector(row)) + " in point " + std::to_string(row));
}

/// The order in which to visit points. Those of a volume on disk are sorted by blocks of samples, so that each chunk is
/// read once, however little memory there is; those of a volume in memory keep their order.
class VisitingOrder {
public:
    VisitingOrder(const Volume& volume, const RowArray& points)
    {
        if (volume.source() == nullptr)
            return;
        constexpr double block = 32.0; // samples along each edge of a chunk, if not otherwise given
        const glm::dvec3 last(volume.shape() - 1);
        const glm::ivec3 blocks = volume.shape() / static_cast<int>(block) + 1;
        std::vector<std::uint64_t> places(points.count());
        for (std::size_t row = 0; row < points.count(); ++row) {
            const glm::dvec3 index = transform_point(volume.world_to_index(), points.vector(row));
            if (is_finite(index))
                places[row] = place_in(blocks, glm::ivec3(glm::clamp(index, glm::dvec3(0.0), last) / block));
        }
        rows_.resize(points.count());
        std::iota(rows_.begin(), rows_.end(), std::size_t(0));
        std::stable_sort(rows_.begin(), rows_.end(),
                         [&](std::size_t a, std::size_t b) { return places[a] < places[b]; });
    }

    /// The row of the point to visit at a time.
    std::size_t operator[](std::size_t time) const { return rows_.empty() ? time : rows_[time]; }

private:
    std::vector<std::size_t> rows_; ///< empty for the given order
};

} // namespace isospline
