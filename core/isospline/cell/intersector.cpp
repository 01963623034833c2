#include "isospline/cell/intersector.h"

#include "isospline/cell/intersectors_of_degrees.h"
#include "isospline/util/error.h"

namespace isospline {

CellIntersector cell_intersector(int degree, Method method)
{
    switch (degree) {
    case 1:
        return linear_intersector(method);
    case 2:
        return quadratic_intersector(method);
    case 3:
        return cubic_intersector(method);
    default:
        throw_invalid("degree", "1, 2 or 3 for a surface", degree);
    }
}

} // namespace isospline
