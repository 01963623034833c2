// Volume, area and curvature of the solid that an isosurface bounds.
#pragma once

#include "isospline/measure/cell_quadrature.h"
#include "isospline/measure/solid.h"
#include "isospline/util/progress.h"

#include <cstddef>

namespace isospline {

struct IntegralOptions {
    int order = 4;          ///< nodes of Gauss-Legendre rules, 2 to 10
    bool surface = true;    ///< the area as well as the volume
    bool curvature = false; ///< the curvatures as well; needs degree 2 or 3
    bool caps = false;      ///< the area has what the half-spaces cut out of the solid
};

/// Integrals over all cells, in world units. The same for any number of threads. Throws std::invalid_argument for an
/// order out of 2-10 and where curvature is asked for at degree 1, whose surfaces have creases.
Integrals integrate(const Solid& solid, const IntegralOptions& options, const Progress& progress = {});

} // namespace isospline
