// Cells whose coefficients have both signs: the paper's morphological gradient of the sign array.
#pragma once

#include "isospline/shell/brick.h"

namespace isospline {

class Volume;

/// The cells of a brick whose (n+1)^3 coefficients c are neither all c < threshold nor all c >= threshold (paper §3).
BrickCells mixed_cells(const Volume& volume, const Brick& brick, double threshold);

} // namespace isospline
