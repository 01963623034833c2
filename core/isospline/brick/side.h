// Where a point or a box is with respect to a solid: one rule for all queries.
#pragma once

namespace isospline {

enum class Side { outside, inside, unknown };

/// The side of something on which f - level is between two bounds; `inward_sign` is 1 if the solid is above the level
/// and -1 if it is below. Zero counts as above, as it does for rays and meshes: the surface is the boundary of the set
/// where f < level, for both solids. If the side of a point is unknown, double precision cannot decide.
inline Side side_of(double least, double most, double inward_sign)
{
    if (least >= 0.0)
        return inward_sign > 0.0 ? Side::inside : Side::outside;
    if (most < 0.0)
        return inward_sign > 0.0 ? Side::outside : Side::inside;
    return Side::unknown;
}

/// Whether a point is in the solid. Where double precision cannot decide, f counts as equal to the level.
inline bool is_inside(Side side, double inward_sign)
{
    return side == Side::inside || (side == Side::unknown && inward_sign > 0.0);
}

} // namespace isospline
