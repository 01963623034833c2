// Volume, area and curvature of the solid that an isosurface bounds.
#pragma once

#include "isospline/measure/cell_quadrature.h"
#include "isospline/measure/components.h"
#include "isospline/measure/solid.h"
#include "isospline/util/progress.h"

#include <cstddef>
#include <vector>

namespace isospline {

struct IntegralOptions {
    int order = 4;          ///< nodes of Gauss-Legendre rules, 2 to 10
    bool surface = true;    ///< the area, with that of caps, as well as the volume
    bool curvature = false; ///< the curvatures as well; needs degree 2 or 3
};

/// Integrals over all cells, in world units. The same for any number of threads. Throws std::invalid_argument for an
/// order outside of 2 to 10, and for curvature at degree 1, whose surfaces have creases.
Integrals integrate(const Solid& solid, const IntegralOptions& options, const Progress& progress = {});

/// The same for each component of a solid, or of another solid that only differs in its cells.
std::vector<Integrals> integrate(const Solid& solid, const Components& components, const IntegralOptions& options,
                                 const Progress& progress = {});

} // namespace isospline
