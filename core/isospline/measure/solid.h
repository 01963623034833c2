// The solid that an isosurface bounds, by cells, for integrals.
#pragma once

#include "isospline/brick/cell_set.h"
#include "isospline/brick/ranges.h"
#include "isospline/brick/side.h"
#include "isospline/brick/solid_planes.h"
#include "isospline/spline/volume.h"

#include <algorithm>
#include <cstddef>

namespace isospline {

/// The points of a volume's domain where sign * (f - level) > 0, in the cells of a set and in all half-spaces. Objects
/// that it refers to must outlive it.
struct Solid {
    const Volume& volume;
    const BrickRanges& ranges;
    double threshold; ///< level - volume.offset()
    double sign;      ///< 1 where the solid is above the level, -1 where it is below
    const CellSet& cells;
    SolidPlanes planes;
};

/// The side of a brick, by the range of its coefficients. A cell of the solid that touches the level may have the
/// surface on a face.
inline Side side_of(const Solid& solid, const Brick& brick)
{
    const BrickRanges::Range range = solid.ranges.brick(brick.first / brick_size);
    const double lower = solid.sign * (static_cast<double>(range.lower) - solid.threshold);
    const double upper = solid.sign * (static_cast<double>(range.upper) - solid.threshold);
    return side_of(std::min(lower, upper), std::max(lower, upper));
}

} // namespace isospline
