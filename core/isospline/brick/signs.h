// Cells whose coefficients have both signs: the paper's morphological gradient of the sign array.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/spline/coefficient_view.h"

#include <cmath>
#include <limits>

namespace isospline {

/// The smallest float not below a threshold: a float is below the one where it is below the other.
inline float threshold_single(double threshold)
{
    const auto nearest = static_cast<float>(threshold);
    return static_cast<double>(nearest) < threshold ? std::nextafter(nearest, std::numeric_limits<float>::infinity())
                                                    : nearest;
}

/// The cells of a brick whose (n+1)^3 coefficients c are neither all c < threshold nor all c >= threshold (paper §3).
BrickCells mixed_cells(const CoefficientView& coefficients, const Brick& brick, int degree, double threshold);

} // namespace isospline
