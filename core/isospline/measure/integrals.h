// Volume, area and curvature of the solid that an isosurface bounds.
#pragma once

#include "isospline/measure/cell_quadrature.h"
#include "isospline/measure/components.h"
#include "isospline/measure/solid.h"
#include "isospline/util/progress.h"

#include <array>
#include <cstddef>
#include <vector>

namespace isospline {

struct IntegralOptions {
    /// The largest error of each integral, divided by that of the absolute value of its integrand. Integrals that
    /// converge too slowly have larger errors.
    double tolerance = 1e-4;
    int order = 0; ///< if not 0, nodes of Gauss-Legendre rules, 2 to 10, for all cells, whatever the tolerance
    std::array<bool, quantity_count> wanted{true, true, false, false}; ///< by quantity; curvatures need degree 2 or 3

    bool needs_curvature() const
    {
        return wanted[index_of(Quantity::mean_curvature)] || wanted[index_of(Quantity::gaussian_curvature)];
    }
    bool needs_surface() const { return wanted[index_of(Quantity::area)] || needs_curvature(); }
};

/// Integrals over all cells, in world units. The same for any number of threads. Throws std::invalid_argument for an
/// order outside of 2 to 10, a tolerance that is not positive, and for curvature at degree 1, whose surfaces have
/// creases.
Integrals integrate(const Solid& solid, const IntegralOptions& options, const Progress& progress = {});

/// The same for each component of a solid, or of another solid that only differs in its cells.
std::vector<Integrals> integrate(const Solid& solid, const Components& components, const IntegralOptions& options,
                                 const Progress& progress = {});

} // namespace isospline
