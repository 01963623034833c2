// A bound on the distance of the surface in a part of a cell from a plane.
#pragma once

#include "isospline/query/lattice_metric.h"
#include "isospline/query/surface_box.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <limits>

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

/// The world distance of two parallel planes that enclose all of the surface in a box; zero if there is no surface, and
/// infinite if there are no such planes.
template <int Degree>
inline double slab_thickness(const SurfaceBox<Degree>& box, const LatticeMetric& metric)
{
    if (!box.has_surface())
        return 0.0;
    const UnitSlab slab = slab_of<Degree>(box);
    const glm::dvec3 gradient_world = (slab.normal / box.size) * metric.to_lattice;
    const double slope = glm::length(gradient_world);
    return slope > 0.0 ? (slab.upper - slab.lower) / slope : std::numeric_limits<double>::infinity();
}

} // namespace isospline
