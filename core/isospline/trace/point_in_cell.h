// A point of a volume's domain as a position in one of its cells.
#pragma once

#include "isospline/cell/coefficients.h"
#include "isospline/shell/isosurface.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

namespace isospline {

/// The cell that contains a point of lattice space, and the point's position in it. The last cell along an axis
/// includes both of its faces; a point outside of the domain belongs to the nearest cell.
struct PointInCell {
    PointInCell(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice)
        : index(glm::clamp(lattice, glm::dvec3(0.0), glm::dvec3(surface.volume().cell_shape() - 1))),
          cell(surface.volume(), surface.threshold(), index), local(lattice - cell.lower)
    {
    }

    glm::ivec3 index;
    VolumeCell cell;
    glm::dvec3 local;
};

} // namespace isospline
