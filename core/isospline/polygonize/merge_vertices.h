// Merging of vertices that coincide, or nearly do.
#pragma once

#include "isospline/polygonize/mesh_part.h"

namespace isospline {

/// Collapses edges that are shorter than `distance`, in lattice units, if the mesh remains a manifold and no face is
/// flipped. Such edges come from nodes of the lattice almost on the surface, and degenerate in single precision
/// formats.
void merge_close_vertices(LabeledMesh& mesh, double distance);

/// Removes vertices without faces.
void drop_unused_vertices(LabeledMesh& mesh);

} // namespace isospline
