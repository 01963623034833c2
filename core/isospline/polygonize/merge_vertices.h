// Vertices of a mesh that lie on one another, or nearly so.
#pragma once

#include "isospline/polygonize/mesh_part.h"

namespace isospline {

/// Collapses edges that are shorter than `distance`, in lattice units, where the mesh stays a manifold and no face
/// turns over. They come from nodes of the lattice that are almost on the surface, and are lost, or worse, in formats
/// of single precision.
void merge_close_vertices(LabeledMesh& mesh, double distance);

/// Drops the vertices that no face has.
void drop_unused_vertices(LabeledMesh& mesh);

} // namespace isospline
