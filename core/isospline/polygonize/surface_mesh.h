// Triangle meshes of isosurfaces.
#pragma once

#include "isospline/shell/isosurface.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace isospline {

/// A connected part of the surface that a mesh leaves out.
struct LeftOut {
    glm::dvec3 position; ///< the centre of the box around it, world space
    glm::dvec3 size;     ///< of the box, along the volume's axes, world units
    double distance;     ///< of its points from the mesh, at most, world units; infinite for a mesh without faces
};

/// A mesh in world space. Faces are counter-clockwise as seen from outside of the solid.
struct SurfaceMesh {
    std::vector<glm::dvec3> vertices;
    std::vector<glm::dvec3> normals; ///< unit, outward
    std::vector<glm::uvec3> faces;

    // What is proven of a mesh with a tolerance or a number of faces.
    /// No point of the mesh is farther than this from the surface or a cap, and no point of these, but for parts that
    /// are left out, is farther than this from the mesh; world units. NaN without a tolerance.
    double distance;
    std::vector<LeftOut> left_out; ///< parts of the surface that may be farther from the mesh than the tolerance
    std::size_t crossings = 0;     ///< pairs of faces that meet elsewhere than at common vertices and edges
    /// What is missing of the volume that the surface encloses, measured at points of the faces; world units cubed. NaN
    /// without a tolerance.
    double missing_volume;
};

/// The mesh of a surface, with its clip and caps.
///
/// Without a tolerance, vertices are roots of f - level, up to rounding, or on caps. With a tolerance, they are on both
/// sides of the surface, so that the volume is kept; those on caps and at borders are not moved. Edges have two faces,
/// or one at an end of the surface: the border of the volume if it is not closed, cells that a mask removes, and a clip
/// that is not capped.
///
/// Without a tolerance, the lattice is that of the cells; features between the corners of cells are missed. With a
/// tolerance, world units, the mesh has many vertices where the surface is curved, to stay within the tolerance, and
/// few elsewhere. Throws std::invalid_argument for a tolerance that is not positive.
SurfaceMesh to_mesh(const IsosurfaceSnapshot& surface, std::optional<double> tolerance = std::nullopt,
                    const Progress& progress = {});

/// The mesh without a tolerance in parts, which need little memory together: each is that of some layers of cells along
/// z. Vertices that parts share are the same, bit for bit.
class MeshParts {
public:
    /// Parts have layers with about this number of cells, or 8 layers if these have more.
    MeshParts(std::shared_ptr<const IsosurfaceSnapshot> surface, std::size_t cells);

    /// The next part, which may have no faces; none after the last one. The progress is that of all parts.
    std::optional<SurfaceMesh> next(const Progress& progress = {});

private:
    std::shared_ptr<const IsosurfaceSnapshot> surface_;
    int layers_, next_ = 0, end_; ///< cells along z
};

/// The mesh with the smallest tolerance that a search finds for at most this number of faces; the tolerance is at least
/// 1/32 of a voxel. It has at least 85% of the faces, unless its tolerance is this one, or a tolerance that is 5%
/// smaller gives more than `faces`. Throws std::invalid_argument if all meshes that were found have
/// more.
SurfaceMesh to_mesh_of_faces(const IsosurfaceSnapshot& surface, std::size_t faces, const Progress& progress = {});

} // namespace isospline
