// Gauss-Legendre quadrature on [0, 1].
#pragma once

#include <vector>

namespace isospline {

struct QuadratureNode {
    double position; ///< in (0, 1)
    double weight;   ///< all weights sum to 1
};

/// The nodes of the rule with `count` >= 1 nodes, exact for polynomials of degree 2 count - 1.
std::vector<QuadratureNode> gauss_legendre(int count);

} // namespace isospline
