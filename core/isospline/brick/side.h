// Where a point or a box is with respect to a solid: one rule for all queries.
#pragma once

namespace isospline {

enum class Side { outside, inside, unknown };

/// The side of something on which f - level, times 1 if the solid is above the level and -1 if it is below, is between
/// two bounds. A plateau at the level is outside. If the side of a point is unknown, double precision cannot decide.
inline Side side_of(double least, double most)
{
    if (!(most > 0.0))
        return Side::outside;
    return least > 0.0 ? Side::inside : Side::unknown;
}

} // namespace isospline
