// The solid that an isosurface bounds: for measuring it, and whether points and samples are in it.
#pragma once

#include "isospline/brick/cutout.h"
#include "isospline/measure/solid.h"
#include "isospline/shell/isosurface.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

namespace isospline {

/// The solid of a surface, which must outlive it.
inline Solid solid_of(const IsosurfaceSnapshot& surface)
{
    return {surface.volume(),      *surface.shared_ranges(), surface.threshold(),
            surface.inward_sign(), surface.kept_cells(),     surface.planes()};
}

/// Whether a point, in world space, is in the solid: it is in the volume's domain, in or on a cell that the mask keeps,
/// in all half-spaces of the clip, and f - level has the sign of Isosurface's Inside. A point where f equals the level,
/// up to the rounding errors of double precision, counts as above it. At a sample that the model interpolates, so
/// does one up to the rounding of the coefficients. A point on the border of the domain may be in the solid, also if it
/// is that of a sample which rounding puts beside the border; one of a half-space's plane is.
bool contains(const IsosurfaceSnapshot& surface, const glm::dvec3& position_world);

/// The samples whose positions are in the solid. It includes its border: a sample on a face of a cell that the mask
/// removes or on a plane of the clip is in the solid if the other side is. A sample where f equals the level, up to
/// the rounding of the coefficients, counts as above it.
Mask samples_inside(const IsosurfaceSnapshot& surface, const Progress& progress = {});

} // namespace isospline
