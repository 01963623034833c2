// What a scene knows of a point of its surfaces beyond where a ray hit it.
#pragma once

#include "isospline/scene/scene_snapshot.h"
#include "isospline/shade/surface_point.h"
#include "isospline/trace/hit.h"

#include <glm/mat4x4.hpp>

#include <cstdint>
#include <memory>
#include <vector>

namespace isospline {

/// Looks up, for hits of a scene, normals and colours that lie between the vertices of a mesh, and curvatures and caps
/// of isosurfaces.
class SurfaceLookup {
public:
    explicit SurfaceLookup(const SceneSnapshot& scene);

    /// Completes a point, whose position, normal and direction to the viewer are given.
    void complete(SurfacePoint& point, const Hit& hit, bool with_curvature) const;

private:
    struct Entry {
        std::shared_ptr<const IsosurfaceSnapshot> surface;
        std::shared_ptr<const Mesh> mesh;
        glm::dmat4 scene_to_object{1.0}; ///< to the mesh's space, or to index space
    };

    const Entry& entry(std::uint32_t geometry_id) const;

    std::vector<std::uint32_t> ids_; ///< ascending
    std::vector<Entry> entries_;     ///< of these
};

} // namespace isospline
