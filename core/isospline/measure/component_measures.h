// The sizes of the connected components of a solid.
#pragma once

#include "isospline/measure/components.h"
#include "isospline/measure/integrals.h"
#include "isospline/measure/solid.h"
#include "isospline/util/progress.h"

#include <cstddef>
#include <vector>

namespace isospline {

/// A component and its volume and area, in world units.
struct MeasuredComponent {
    ComponentCount count;
    Integrals integrals;
};

/// All components of a solid, the largest volume first; of two with the same volume, the one with the earlier first
/// brick. Throws like integrate().
std::vector<MeasuredComponent> measure_components(const Solid& solid, const IntegralOptions& options,
                                                  const Progress& progress = {});

/// The same components without integrals: those with the most inside cells first.
std::vector<MeasuredComponent> count_components(const Solid& solid, const Progress& progress = {});

/// The cells of the `count` components of a solid with the largest volumes, or all cells of the solid's set if there
/// are no more components. Of two with the same volume, the one with the earlier first brick counts as larger. The
/// solid must have no clip.
CellSet largest_components(const Solid& solid, std::size_t count, const Progress& progress = {});

} // namespace isospline
