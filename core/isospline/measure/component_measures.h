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

/// The components of a solid before it is clipped, the largest volume first. Components of zero volume, where f only
/// touches the level, are left out. Throws like integrate().
std::vector<MeasuredComponent> measure_components(Solid solid, const IntegralOptions& options,
                                                  const Progress& progress = {});

/// All components of a solid before it is clipped, without integrals: those with the most inside cells first.
std::vector<MeasuredComponent> count_components(const Solid& solid, const Progress& progress = {});

/// The cells of the `count` components of a solid with the largest volumes, or all cells of the solid's set if there
/// are no more components. Of two with the same volume, the one with the earlier first brick counts as larger.
CellSet largest_components(const Solid& solid, std::size_t count, const Progress& progress = {});

} // namespace isospline
