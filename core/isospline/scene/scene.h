// Isosurfaces and meshes in one Embree scene.
#pragma once

#include "isospline/scene/build_options.h"
#include "isospline/scene/mesh.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/shell/isosurface.h"
#include "isospline/util/progress.h"

#include <glm/mat4x4.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

namespace isospline {

/// What a scene holds under a geometry id, where it is, and what sees it.
struct PlacedObject {
    std::variant<std::shared_ptr<const Isosurface>, std::shared_ptr<const Mesh>> object;
    glm::dmat4 transform{1.0}; ///< the object's world space to the scene's
    SeenBy seen_by{};
};

/// Isosurfaces and triangle meshes that rays can be cast at.
///
/// Rays are cast at a snapshot of the scene. Changes (objects added, moved and removed, another level of an isosurface)
/// are in the next snapshot, for which an isosurface or mesh is built once, however many times it has been added, and
/// again only where its shape has changed.
///
/// Any number of threads may change a scene, take snapshots and use them at a time. A change waits for nobody. Of
/// threads that want a snapshot while something has changed, one builds it and the others wait.
class Scene {
public:
    /// Throws std::invalid_argument for an edge of boxes that is not one of those named.
    explicit Scene(const BuildOptions& options = {});
    ~Scene();
    Scene(Scene&&) noexcept;
    Scene& operator=(Scene&&) noexcept;

    /// Adds an object, placed by `transform` (object's world space to the scene's). Returns its geometry id: ids count
    /// up from 0 and are never used again. Throws std::invalid_argument for a transform that is singular or not affine,
    /// and where no id is left, after 2^32 - 1 of them.
    std::uint32_t add(std::shared_ptr<const Isosurface> surface, const glm::dmat4& transform = glm::dmat4(1.0),
                      SeenBy seen_by = {});
    std::uint32_t add(std::shared_ptr<const Mesh> mesh, const glm::dmat4& transform = glm::dmat4(1.0),
                      SeenBy seen_by = {});

    /// These throw std::invalid_argument for an id that is not in the scene, and for a transform as add() does.
    void remove(std::uint32_t geometry_id);
    void set_transform(std::uint32_t geometry_id, const glm::dmat4& transform);
    void set_visibility(std::uint32_t geometry_id, SeenBy seen_by);

    /// The scene as it is now. Builds what has changed since the last snapshot; cheap where nothing has. Throws
    /// Cancelled where the callback returns false, also while another thread builds; the next call then builds what
    /// has not been.
    std::shared_ptr<const SceneSnapshot> snapshot(const Progress& progress = {});
    /// Whether nothing has changed since a snapshot of this scene.
    bool is_current(const SceneSnapshot& snapshot) const;

    /// What is under a geometry id. Throws std::invalid_argument for one that is not in the scene.
    PlacedObject object(std::uint32_t geometry_id) const;
    bool contains(std::uint32_t geometry_id) const;
    /// The geometry ids, ascending.
    std::vector<std::uint32_t> ids() const;
    /// How many there are.
    std::size_t count() const;
    /// As given.
    const BuildOptions& build_options() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace isospline
