// The mesh of an isosurface, and of its caps, in the cubes that a clip cuts.
#pragma once

#include "isospline/polygonize/clip_cubes.h"
#include "isospline/polygonize/mesh_part.h"

namespace isospline {

/// The part of the surface in cubes that are cut, and the caps, if the surface is capped.
///
/// Each cube is six tetrahedra about its diagonal (Kuhn). Planes cut them one after the other into tetrahedra, by the
/// signs at their corners; those that are left are marched by the signs of f - level. Tetrahedra that share a face
/// share what becomes of it, so the mesh is a manifold whatever the signs are, and vertices where a cap ends at the
/// surface are on both.
template <int Degree>
MeshPart march_cut_cubes(const LatticeField<Degree>& field, const ClipCubes& clip, const Progress& progress);

} // namespace isospline
