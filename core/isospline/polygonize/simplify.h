// As few triangles as keep a mesh near the surface.
#pragma once

#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/mesh_part.h"

namespace isospline {

/// Collapses edges of a mesh, those that change it least first (M. Garland, P. Heckbert, "Surface simplification using
/// quadric error metrics", SIGGRAPH 1997), as long as both distances stay within `tolerance`, world units: those of the
/// vertices that go, which are points of the surface, from the mesh, and those of points of the mesh, at most half
/// a cell apart, from the surface. Vertices that stay do not move. Returns the largest distance of a vertex that went.
template <int Degree>
double simplify(const LatticeField<Degree>& field, LabeledMesh& mesh, double tolerance, const Progress& progress);

/// The largest distance of the mesh's faces from the surface, world units, among points at most a quarter of a cell
/// apart, caps left out.
template <int Degree>
double distance_from_surface(const LatticeField<Degree>& field, const LabeledMesh& mesh, const Progress& progress);

} // namespace isospline
