// The solid that an isosurface bounds, by cells, for integrals.
#pragma once

#include "isospline/brick/cell_set.h"
#include "isospline/brick/ranges.h"
#include "isospline/brick/side.h"
#include "isospline/brick/solid_planes.h"
#include "isospline/spline/volume.h"

#include <cstddef>

namespace isospline {

/// The points of a volume's domain where f >= level, or f < level, in the cells of a set and in all half-spaces.
/// Objects that it refers to must outlive it.
struct Solid {
    const Volume& volume;
    const BrickRanges& ranges;
    double threshold; ///< level - volume.offset()
    double sign;      ///< 1 where the solid is above the level, -1 where it is below
    const CellSet& cells;
    SolidPlanes planes;
};

/// The side of a brick, by the range of its coefficients. If it is known, no surface is in the brick or on its border
/// that is not in another one: a cell where f <= level may have the surface on a face.
inline Side side_of(const Solid& solid, const Brick& brick)
{
    const BrickRanges::Range range = solid.ranges.brick(brick.first / brick_size);
    return side_of(static_cast<double>(range.lower) - solid.threshold,
                   static_cast<double>(range.upper) - solid.threshold, solid.sign);
}

/// Calls `visit(brick, side)` for all bricks that may hold a part of the solid, octet by octet.
template <typename Visit>
void for_each_brick(const Solid& solid, const Visit& visit)
{
    const glm::ivec3 bricks = brick_shape(solid.volume.cell_shape());
    for (std::size_t octet = 0; octet < solid.ranges.octets().size(); ++octet)
        for (int child = 0; child < 8; ++child) {
            const glm::ivec3 place = 2 * at_place(solid.ranges.shape(), octet) + child_position(child);
            if (place.x >= bricks.x || place.y >= bricks.y || place.z >= bricks.z)
                continue;
            const Brick brick = brick_at(solid.volume.cell_shape(), place);
            if (const Side side = side_of(solid, brick); side != Side::outside && !solid.cells.has_none_of(brick))
                visit(brick, side);
        }
}

} // namespace isospline
