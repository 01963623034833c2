// Derivatives of volume and area by the level and by the coefficients: docs/method.md, "Derivatives of measures".
#pragma once

#include "isospline/measure/solid.h"
#include "isospline/util/progress.h"

#include <vector>

namespace isospline {

/// A number that depends on the volume and the area of a solid, by its derivatives by these.
struct MeasureWeights {
    double volume = 0.0;
    double area = 0.0;
};

/// Its derivatives.
struct MeasureGradient {
    double by_level = 0.0;
    std::vector<double>
        by_coefficients; ///< in the order of the grid of samples, x + nx (y + ny z); empty if not wanted
};

/// Computes them with Gauss-Legendre rules of `order` nodes, 2 to 10, along each axis. The same for any number of
/// threads. Throws std::invalid_argument for another order, and for an area at degree 1, whose surfaces have creases.
MeasureGradient measure_gradient(const Solid& solid, const MeasureWeights& weights, int order, bool coefficients,
                                 const Progress& progress = {});

} // namespace isospline
