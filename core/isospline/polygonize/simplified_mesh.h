// Meshes with few faces that are proven to be near the surface, and to keep its volume.
#pragma once

#include "isospline/math/box.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/surface_parts.h"
#include "isospline/shell/isosurface.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <vector>

namespace isospline {

/// A mesh with few faces, and what is proven of it. Locations are in lattice space.
struct SimplifiedMesh {
    LabeledMesh mesh;
    std::vector<glm::dvec3> feet; ///< for each vertex, the point of the surface or a cap where it was
    double distance;              ///< as that of a SurfaceMesh
    std::vector<Box> uncovered;   ///< boxes with surface that may be beyond the tolerance
    double missing_volume;        ///< as that of a SurfaceMesh
};

/// Simplifies the mesh of a lattice for this tolerance, in world units, or a smaller one.
template <int Degree>
SimplifiedMesh simplified_mesh(const IsosurfaceSnapshot& surface, const SurfaceParts& parts, const LabeledMesh& fine,
                               double tolerance, const Progress& progress);

} // namespace isospline
