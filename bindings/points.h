// Points given from Python.
#pragma once

#include "arrays.h"

#include "isospline/util/check.h"

#include <cmath>
#include <cstddef>
#include <string>

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

} // namespace isospline
