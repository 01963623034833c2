// The solid that an isosurface bounds, as integrals see it: by cells.
#pragma once

#include "isospline/brick/cutout.h"
#include "isospline/brick/ranges.h"
#include "isospline/spline/volume.h"

#include <vector>

namespace isospline {

/// The points of a volume's domain where sign * (f - level) > 0, in the cells that the mask leaves and in all
/// half-spaces. What is referred to must outlive the object.
struct Solid {
    const Volume& volume;
    const BrickRanges& ranges;
    double threshold; ///< level - volume.offset()
    double sign;      ///< 1 where the solid is above the level, -1 where it is below
    const Mask& mask; ///< of Volume's samples; empty: nothing is cut away
    std::vector<HalfSpace> clip_lattice;
};

/// What coefficients tell of all points of a brick or a cell.
enum class Side { outside, inside, unknown };

/// Of coefficients, less the threshold and times the solid's sign, between two bounds. A plateau at the level is
/// outside, as in contains(); a cell of the solid that touches the level may have the surface on a face.
inline Side side_of(double least, double most)
{
    if (!(most > 0.0))
        return Side::outside;
    return least > 0.0 ? Side::inside : Side::unknown;
}

} // namespace isospline
