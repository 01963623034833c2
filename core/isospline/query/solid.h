// The solid that an isosurface bounds: for measuring it, and its samples.
#pragma once

#include "isospline/brick/cutout.h"
#include "isospline/measure/solid.h"
#include "isospline/shell/isosurface.h"
#include "isospline/util/progress.h"

namespace isospline {

/// The solid of a surface, which must outlive it.
inline Solid solid_of(const IsosurfaceSnapshot& surface)
{
    return {surface.volume(),      *surface.shared_ranges(), surface.threshold(),
            surface.inward_sign(), surface.kept_cells(),     surface.planes()};
}

/// The samples whose positions are in the solid. It includes its border: a sample on a face of a cell that the mask
/// removes or on a plane of the clip is in the solid if the other side is. A sample where f equals the level, up to
/// the rounding of the coefficients, counts as above it.
Mask samples_inside(const IsosurfaceSnapshot& surface, const Progress& progress = {});

} // namespace isospline
