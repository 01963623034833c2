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
};

/// The mesh of a surface, clipped and capped as it is.
///
/// Vertices are roots of f - level, up to rounding, or on caps. Edges have two faces, or one where the surface ends: at
/// the border of the volume, at cells that a mask cuts away, and at a clip that is not capped.
SurfaceMesh to_mesh(const IsosurfaceSnapshot& surface, const Progress& progress = {});

} // namespace isospline
