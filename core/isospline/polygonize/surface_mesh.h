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
    /// The largest distance between the surface and the mesh, either way, that was measured; world units. Not a number
    /// where none was.
    double distance;
};

/// The mesh of a surface, clipped and capped as it is.
///
/// Vertices are roots of f - level, up to rounding, or on caps. Edges have two faces, or one where the surface ends: at
/// the border of the volume, at cells that a mask cuts away, and at a clip that is not capped.
///
/// Without a tolerance, the lattice is that of the cells: what passes between the corners of cells is not seen. With a
/// tolerance, world units, there are as many vertices where the surface bends as keep the mesh near it, and few
/// elsewhere. Throws std::invalid_argument for a tolerance that is not positive.
SurfaceMesh to_mesh(const IsosurfaceSnapshot& surface, std::optional<double> tolerance = std::nullopt,
                    const Progress& progress = {});

} // namespace isospline
