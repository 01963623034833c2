// Simplification of a mesh within a distance from the surface.
#pragma once

#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/mesh_part.h"

namespace isospline {

/// Collapses edges of a mesh, those that change it least first (M. Garland, P. Heckbert, "Surface simplification using
/// quadric error metrics", SIGGRAPH 1997). Two distances stay within `tolerance`, in world units: the distance of
/// removed vertices, which are points of the surface, from the mesh; and the distance of changed faces from the
/// surface, at points at most measured_spacing apart. Remaining vertices do not move. Returns the largest distance of a
/// removed vertex.
template <int Degree>
double simplify(const LatticeField<Degree>& field, LabeledMesh& mesh, double tolerance, const Progress& progress);

} // namespace isospline
