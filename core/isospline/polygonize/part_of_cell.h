// Parts of cells.
#pragma once

#include "isospline/query/surface_box.h"

#include <glm/vec3.hpp>

#include <cstddef>

namespace isospline {

/// The part of a cell from `lower` to `upper`, in local coordinates; `box` is the whole cell.
template <int Degree>
inline SurfaceBox<Degree> part_of_cell(SurfaceBox<Degree> box, const glm::dvec3& lower, const glm::dvec3& upper)
{
    for (int axis = 0; axis < 3; ++axis) {
        // De Casteljau's algorithm: the part below the upper end, and of that, the part above the lower end.
        const double until = upper[axis], from = lower[axis] / upper[axis];
        map_rows<Degree>(box.b, axis, [until, from](Bernstein<Degree>& b) {
            for (std::size_t round = 1; round <= Degree; ++round)
                for (std::size_t i = Degree; i >= round; --i)
                    b[i] = (1.0 - until) * b[i - 1] + until * b[i];
            for (std::size_t round = 1; round <= Degree; ++round)
                for (std::size_t i = 0; i + round <= Degree; ++i)
                    b[i] = (1.0 - from) * b[i] + from * b[i + 1];
        });
    }
    box.lower = lower;
    box.size = upper - lower;
    return box;
}

} // namespace isospline
