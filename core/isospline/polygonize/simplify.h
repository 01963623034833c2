// Simplification of a mesh within a distance from the surface.
#pragma once

#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/util/progress.h"

#include <cstdint>
#include <vector>

namespace isospline {

/// How far simplification may go.
struct Simplicity {
    double of_faces;                  ///< largest measured distance of a changed face from the surface, world units
    double of_vertices;               ///< largest distance of a removed vertex from the nearest face around
    std::vector<std::uint8_t> locked; ///< vertices that stay where this is not 0; empty if all may go
};

/// A vertex that is moved onto one of its neighbours.
struct Collapse {
    std::uint32_t from, to;
};

/// Collapses edges of a mesh, those that change it least first (M. Garland, P. Heckbert, "Surface simplification using
/// quadric error metrics", SIGGRAPH 1997). Remaining vertices do not move. A collapse is done only if each face that it
/// changes is near the surface (Nearness), removed vertices, which are points of the surface, are near these faces, and
/// these faces cross no other face of the mesh.
///
/// First repeats the collapses in `history`, of a run with less locked vertices, as far as they are not near the
/// others. `history` becomes that of this run.
template <int Degree>
void simplify(const LatticeField<Degree>& field, LabeledMesh& mesh, const Simplicity& simplicity,
              std::vector<Collapse>& history, const Progress& progress);

} // namespace isospline
