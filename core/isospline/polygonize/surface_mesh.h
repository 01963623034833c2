// Triangle meshes of isosurfaces.
#pragma once

#include "isospline/shell/isosurface.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <optional>
#include <vector>

namespace isospline {

/// A mesh in world space. Faces are counter-clockwise as seen from outside of the solid.
struct SurfaceMesh {
    std::vector<glm::dvec3> vertices;
    std::vector<glm::dvec3> normals; ///< unit, outward
    std::vector<glm::uvec3> faces;
    /// The largest measured distance between the surface and the mesh, in both directions, world units; NaN if it was
    /// not measured.
    double distance;
};

/// The mesh of a surface, with its clip and caps.
///
/// Vertices are roots of f - level, up to rounding, or on caps. Edges have two faces, or one at an end of the
/// surface: the border of the volume if it is not closed, cells that a mask removes, and a clip that is not capped.
///
/// Without a tolerance, the lattice is that of the cells; features between the corners of cells are missed. With a
/// tolerance, world units, the mesh has many vertices where the surface is curved, to stay within the tolerance, and
/// few elsewhere. Throws std::invalid_argument for a tolerance that is not positive.
SurfaceMesh to_mesh(const IsosurfaceSnapshot& surface, std::optional<double> tolerance = std::nullopt,
                    const Progress& progress = {});

} // namespace isospline
