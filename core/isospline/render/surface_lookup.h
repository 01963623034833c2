// Properties of a scene's surfaces at hits.
#pragma once

#include "isospline/scene/scene_snapshot.h"
#include "isospline/shade/surface_point.h"
#include "isospline/trace/hit.h"

#include <glm/mat4x4.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace isospline {

/// Looks up, for hits of a scene, normals, colours and values interpolated between the vertices of a mesh, and
/// curvatures and caps of isosurfaces.
class SurfaceLookup {
public:
    explicit SurfaceLookup(const SceneSnapshot& scene);

    /// Whether a hit has everything except the curvature and the value: it is not on a cap, and not on a mesh with its
    /// own normals or colours.
    bool is_plain(const Hit& hit) const { return hit.primitive_id < entry(hit.geometry_id).plain_primitives; }

    /// Completes a point with given position, normal and direction to the viewer.
    void complete(SurfacePoint& point, const Hit& hit, bool with_curvature) const;

private:
    struct Entry {
        std::shared_ptr<const IsosurfaceSnapshot> surface;
        std::shared_ptr<const Mesh> mesh;
        glm::dmat4 scene_to_object{1.0}; ///< to the mesh's space, or to index space
        std::uint64_t plain_primitives;  ///< ids below it belong to plain hits
    };

    const Entry& entry(std::uint32_t geometry_id) const
    {
        // In most scenes no object has been removed, so ids count up from 0.
        if (geometry_id < ids_.size() && ids_[geometry_id] == geometry_id)
            return entries_[geometry_id];
        return entries_[static_cast<std::size_t>(std::lower_bound(ids_.begin(), ids_.end(), geometry_id) -
                                                 ids_.begin())];
    }

    std::vector<std::uint32_t> ids_; ///< ascending
    std::vector<Entry> entries_;     ///< of these
};

} // namespace isospline
