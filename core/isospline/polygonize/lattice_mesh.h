// The mesh of a lattice that is fine enough for a tolerance.
#pragma once

#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/surface_parts.h"
#include "isospline/shell/isosurface.h"
#include "isospline/util/progress.h"

namespace isospline {

/// The mesh of a surface with its clip and caps, from the lattice of the cells.
template <int Degree>
LabeledMesh lattice_mesh(const IsosurfaceSnapshot& surface, const Progress& progress);

/// The mesh of a lattice that is refined wherever the surface and the mesh are not near to each other, in both
/// directions: within a part of the tolerance, in world units, so that the mesh can be simplified. What remains are
/// parts of the surface between the nodes of the finest lattice.
template <int Degree>
LabeledMesh lattice_mesh(const IsosurfaceSnapshot& surface, const SurfaceParts& parts, double tolerance,
                         const Progress& progress);

/// The part of the mesh of the cells' lattice in the bricks whose first cells are in the layers [first, last) along z.
/// The vertices that it shares with other parts are the same, bit for bit.
template <int Degree>
LabeledMesh lattice_mesh_of_layers(const IsosurfaceSnapshot& surface, int first, int last, const Progress& progress);

} // namespace isospline
