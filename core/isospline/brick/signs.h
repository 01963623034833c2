// Cells whose coefficients have both signs: the paper's morphological gradient of the sign array.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/spline/coefficient_view.h"

namespace isospline {

/// The cells of a brick whose (n+1)^3 coefficients c are neither all c < threshold nor all c >= threshold (paper §3).
BrickCells mixed_cells(const CoefficientView& coefficients, const Brick& brick, int degree, double threshold);

} // namespace isospline
