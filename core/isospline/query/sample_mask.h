// The samples of a volume that are in the solid that an isosurface bounds.
#pragma once

#include "isospline/brick/cutout.h"
#include "isospline/shell/isosurface.h"
#include "isospline/util/progress.h"

namespace isospline {

/// The samples whose positions are in the solid. It includes its border: a sample on a face of a cell that the mask
/// removes or on a plane of the clip is in the solid if the other side is. A sample where f equals the level, up to
/// the rounding errors of double precision, counts as above it.
Mask samples_inside(const IsosurfaceSnapshot& surface, const Progress& progress = {});

} // namespace isospline
