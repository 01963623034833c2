// The intersectors of each degree. Each has a source of its own: compiled together, they take longer than all other
// sources of a build on two cores.
#pragma once

#include "isospline/cell/intersector.h"

namespace isospline {

CellIntersector linear_intersector(Method method);
CellIntersector quadratic_intersector(Method method);
CellIntersector cubic_intersector(Method method);

} // namespace isospline
