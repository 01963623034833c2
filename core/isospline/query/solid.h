// The solid that an isosurface bounds, for measuring it.
#pragma once

#include "isospline/measure/solid.h"
#include "isospline/shell/isosurface.h"

namespace isospline {

/// The solid of a surface, which must outlive it.
inline Solid solid_of(const IsosurfaceSnapshot& surface)
{
    return {surface.volume(),      *surface.shared_ranges(), surface.threshold(),
            surface.inward_sign(), surface.kept_cells(),     surface.planes()};
}

} // namespace isospline
