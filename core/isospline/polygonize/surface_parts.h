// The parts of cells that are near to a surface, and those that may contain some of it.
#pragma once

#include "isospline/polygonize/cell_parts.h"
#include "isospline/polygonize/lattice_field.h"
#include "isospline/util/progress.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

namespace isospline {

/// Most of what has to be proven of a mesh with a tolerance of a cell or more is a look at these parts.
///
/// Where f - level has different signs at both ends of an edge of a part, there is a root on it; parts with all points
/// near to all of the edge are near to the surface. Between the corners of a part, f differs from the trilinear
/// function with the same values by at most h^2 / 8 times the largest second derivative along each axis, for parts of
/// size h; a part without surface has corners far enough from the level, on one side. (The grid is that of S. Zelinka
/// and M. Garland, "Permission grids: practical, error-bounded simplification", ACM TOG 21(2), 2002; its boxes are
/// proven.)
class SurfaceParts {
public:
    /// The distance is that of near parts, in world units.
    /// There are no parts if the distance is too small for them.
    template <int Degree>
    SurfaceParts(const LatticeField<Degree>& field, double distance, const Progress& progress);

    /// All points of these parts are within the distance of the surface.
    const CellParts& near() const { return near_; }
    /// All of the surface is in these, if there are any parts.
    const CellParts& crossed() const { return crossed_; }
    /// The distance of points of near parts from the surface, at most; 0 if there are no parts.
    double distance() const { return distance_; }
    /// Whether a point of the domain, in lattice space, is in a near part.
    bool is_near(const glm::dvec3& at) const
    {
        return near_.contains(glm::min(glm::ivec3(static_cast<double>(parts_per_cell) * at), near_.shape() - 1));
    }

private:
    CellParts near_, crossed_;
    double distance_ = 0.0;
};

} // namespace isospline
