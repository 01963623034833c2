// Cells whose coefficients have both signs: the paper's morphological gradient of the sign array.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/spline/coefficient_view.h"

#include <cmath>
#include <limits>

namespace isospline {

/// The smallest float that is not below a threshold. A float is below it exactly if it is below the threshold.
inline float threshold_single(double threshold)
{
    const auto nearest = static_cast<float>(threshold);
    return static_cast<double>(nearest) < threshold ? std::nextafter(nearest, std::numeric_limits<float>::infinity())
                                                    : nearest;
}

/// The mixed cells of a brick: their (n+1)^3 coefficients are neither all below nor all at or above the threshold
/// (paper §3).
BrickCells mixed_cells(const CoefficientView& coefficients, const Brick& brick, int degree, double threshold);

} // namespace isospline
