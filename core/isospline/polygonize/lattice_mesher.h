// The mesh of an isosurface where no clip cuts it: marching cubes on the lattice.
#pragma once

#include "isospline/polygonize/clip_cubes.h"
#include "isospline/polygonize/mesh_part.h"

#include <vector>

namespace isospline {

/// The parts of the surface in cubes that are wholly inside of the clip. Signs are those at the corners of cubes and,
/// where the corners of a face alternate, in its middle, so that cubes agree on what they share.
///
/// W. Lorensen, H. Cline, "Marching cubes", SIGGRAPH 1987, with loops that are traced from face to face in place of a
/// table of triangles. Each crossed edge has one vertex, each loop is a disc, and discs share nothing but what is on
/// the faces of cubes: the mesh is a manifold whatever the signs are.
template <int Degree>
std::vector<MeshPart> march_cubes(const LatticeField<Degree>& field, const ClipCubes& clip, const Progress& progress);

} // namespace isospline
