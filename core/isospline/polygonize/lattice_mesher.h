// The mesh of an isosurface in plain cubes: marching cubes on the lattice.
#pragma once

#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/special_cubes.h"

#include <vector>

namespace isospline {

/// The parts of the surface in plain cubes. Signs are those at the corners of cubes and,
/// where the corners of a face alternate, in its middle, so that cubes agree on what they share.
///
/// W. Lorensen, H. Cline, "Marching cubes", SIGGRAPH 1987, with loops that are traced from face to face in place of a
/// table of triangles. Each crossed edge has one vertex, each loop is a disc, and discs share nothing but what is on
/// the faces of cubes: the mesh is a manifold whatever the signs are.
template <int Degree>
std::vector<MeshPart> march_cubes(const LatticeField<Degree>& field, const SpecialCubes& special,
                                  const Progress& progress);

} // namespace isospline
