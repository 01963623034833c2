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
#include <map>
#include <memory>
#include <variant>
#include <vector>

namespace isospline {

/// An object of a scene with its placement and the rays that see it.
struct PlacedObject {
    std::variant<std::shared_ptr<const Isosurface>, std::shared_ptr<const Mesh>> object;
    glm::dmat4 transform{1.0}; ///< the object's world space to the scene's
    SeenBy seen_by{};
};

/// Isosurfaces and triangle meshes that rays can be cast at.
///
/// Rays are cast at a snapshot of the scene. The next snapshot shows all changes: objects that were added, moved and
/// removed, and levels that were changed. Each isosurface or mesh is built once, even if it was added several times,
/// and built again only if its shape has changed.
///
/// Any number of threads may change a scene, take snapshots and use them at the same time. A change never waits. If
/// several threads need a snapshot after a change, one builds it and the others wait.
class Scene {
public:
    explicit Scene(const BuildOptions& options = {});
    ~Scene();
    Scene(Scene&&) noexcept;
    Scene& operator=(Scene&&) noexcept;

    /// Adds an object. `transform` maps the object's world space to the scene's. Returns its geometry id: ids count up
    /// from 0 and are never reused. Throws std::invalid_argument for no object, for a transform that is singular or not
    /// affine, and after 2^32 - 1 objects, when no id is left.
    std::uint32_t add(std::shared_ptr<const Isosurface> surface, const glm::dmat4& transform = glm::dmat4(1.0),
                      SeenBy seen_by = {});
    std::uint32_t add(std::shared_ptr<const Mesh> mesh, const glm::dmat4& transform = glm::dmat4(1.0),
                      SeenBy seen_by = {});

    /// These throw std::invalid_argument for an id that is not in the scene, and for a transform that add() rejects.
    void remove(std::uint32_t geometry_id);
    void set_transform(std::uint32_t geometry_id, const glm::dmat4& transform);
    void set_visibility(std::uint32_t geometry_id, SeenBy seen_by);

    /// The current state of the scene. Builds the objects that have changed since the last snapshot; cheap if none has.
    /// Throws Cancelled if the callback returns false, even while another thread builds; the next call then builds the
    /// rest. If it pays for the rays to come, by what settled indexes save these (SettlingGain), it is that of
    /// settle().
    std::shared_ptr<const SceneSnapshot> snapshot(const Progress& progress = {}, std::uint64_t settling_gain = 0);
    /// A snapshot like snapshot(), with settled indexes: they take longer to build, and rays are faster. They are built
    /// here, unless they exist already. Without this call, they are built in the background when so many rays have been
    /// cast at one state of the scene that it pays, and later snapshots have them. Rays have the same hits in any case.
    /// Volumes whose coefficients are not in memory have no settled index. Throws like snapshot().
    std::shared_ptr<const SceneSnapshot> settle(const Progress& progress = {});
    /// Whether the newest snapshot is current and has settled indexes wherever there are any.
    bool is_settled() const;
    /// Uses what another scene with the same options has built, wherever both have the same object at the same level.
    void share_built_objects(const Scene& other);
    /// Whether nothing has changed since a snapshot of this scene.
    bool is_current(const SceneSnapshot& snapshot) const;

    /// The object with a geometry id. Throws std::invalid_argument for an id that is not in the scene.
    PlacedObject object(std::uint32_t geometry_id) const;
    bool contains(std::uint32_t geometry_id) const;
    /// The geometry ids, ascending.
    std::vector<std::uint32_t> ids() const;
    /// The objects by geometry id, all at one moment.
    std::map<std::uint32_t, PlacedObject> objects() const;
    /// The number of objects.
    std::size_t count() const;
    /// The options that the constructor got.
    const BuildOptions& build_options() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace isospline
