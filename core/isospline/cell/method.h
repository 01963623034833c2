// The ways to find roots in cells.
#pragma once

namespace isospline {

/// How the root in a cell is found.
enum class Method {
    exact,     ///< Bernstein form of the polynomial along the ray: never misses a root
    reference, ///< the same, scalar and all in double precision: slow, the reference of the tests
    bracket    ///< the paper's §4: opposite signs at the ends of the cell, then Brent's method
};

} // namespace isospline
