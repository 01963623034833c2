// The mesh of an isosurface in plain cubes: marching cubes on the lattice.
#pragma once

#include "isospline/polygonize/cells_in_question.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/special_cubes.h"

#include <vector>

namespace isospline {

/// The parts of the surface in plain cubes. They depend on the signs at the corners of cubes and, if the corners of a
/// face alternate, on the sign in its middle. So cubes agree on shared faces.
///
/// W. Lorensen, H. Cline, "Marching cubes", SIGGRAPH 1987, with loops that are traced from face to face instead of a
/// table of triangles. Each crossed edge has one vertex, each loop is a disc, and discs only share parts of the faces
/// of cubes. So the mesh is a manifold for all signs.
///
/// A filter selects cells.
template <int Degree>
std::vector<MeshPart> march_cubes(const LatticeField<Degree>& field, const SpecialCubes& special,
                                  const CellFilter& filter, const Progress& progress);

} // namespace isospline
