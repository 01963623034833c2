// The solid that an isosurface bounds, by cells, for integrals.
#pragma once

#include "isospline/brick/cell_set.h"
#include "isospline/brick/cutout.h"
#include "isospline/brick/ranges.h"
#include "isospline/spline/volume.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace isospline {

/// The points of a volume's domain where sign * (f - level) > 0, in the cells of a set and in all half-spaces. Objects
/// that it refers to must outlive it.
struct Solid {
    const Volume& volume;
    const BrickRanges& ranges;
    double threshold; ///< level - volume.offset()
    double sign;      ///< 1 where the solid is above the level, -1 where it is below
    const CellSet& cells;
    std::vector<HalfSpace> clip_lattice;
};

/// The classification of all points of a brick or a cell by coefficients.
enum class Side { outside, inside, unknown };

/// The classification for coefficients between two bounds, less the threshold and times the solid's sign. A plateau at
/// the level is outside, as in contains(). A cell of the solid that touches the level may have the surface on a face.
inline Side side_of(double least, double most)
{
    if (!(most > 0.0))
        return Side::outside;
    return least > 0.0 ? Side::inside : Side::unknown;
}

/// The classification of a brick, by the range of its coefficients.
inline Side side_of(const Solid& solid, const Brick& brick)
{
    const glm::ivec3 position = brick.first / brick_size, octet = position / 2, in_octet = position - 2 * octet;
    const auto child = static_cast<std::size_t>(in_octet.x + 2 * in_octet.y + 4 * in_octet.z);
    const BrickRanges::Range range = solid.ranges.octets()[place_in(solid.ranges.shape(), octet)].brick(child);
    const double lower = solid.sign * (static_cast<double>(range.lower) - solid.threshold);
    const double upper = solid.sign * (static_cast<double>(range.upper) - solid.threshold);
    return side_of(std::min(lower, upper), std::max(lower, upper));
}

} // namespace isospline
