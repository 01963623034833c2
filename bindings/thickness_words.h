// What measures and colours of the thickness have in common.
#pragma once

#include "arrays.h"

#include "isospline/query/lattice_metric.h"
#include "isospline/scene/thickness.h"

namespace isospline {

inline const EnumWords<ThicknessMethod> thickness_words{{"max_sphere", ThicknessMethod::max_sphere},
                                                        {"ray", ThicknessMethod::ray}};

/// The height of ripples that do not matter, if none is given.
inline double default_ripple(const Isosurface& surface)
{
    return 0.5 * LatticeMetric(surface.volume().lattice_to_world()).shortest_edge;
}

} // namespace isospline
