// Makes a snapshot from the entries of a scene.
#pragma once

#include "isospline/scene/object.h"
#include "isospline/scene/scene.h"
#include "isospline/scene/scene_snapshot_impl.h"
#include "isospline/util/progress.h"

#include <cstdint>
#include <map>
#include <memory>
#include <unordered_map>
#include <variant>

namespace isospline {

/// The objects that users have added to a scene, by geometry id.
using Entries = std::map<std::uint32_t, PlacedObject>;

/// Objects by the address of the isosurface or mesh that they show.
using Objects = std::unordered_map<const void*, std::shared_ptr<const Object>>;

/// The current state of an object.
ShownObject shown_now(const std::variant<std::shared_ptr<const Isosurface>, std::shared_ptr<const Mesh>>& object);

/// The address of the isosurface or mesh.
std::shared_ptr<const void> address(const ShownObject& shown);

/// An object that is not built yet.
std::shared_ptr<Object> make_object(const ShownObject& shown);

/// Throws std::invalid_argument for a placement that is not valid in any scene.
void check_alone(const LocalSpace& local, const glm::dmat4& transform, std::uint32_t id);

/// Makes one snapshot.
struct SnapshotBuilder {
    /// Builds the objects that are neither in the previous snapshot nor among the known objects, and adds them to the
    /// known objects. If this throws, the next builder uses those that were finished.
    std::unique_ptr<SceneSnapshot::Impl> build(const Progress& progress);

    std::shared_ptr<const Entries> entries;
    std::shared_ptr<const SceneSnapshot> before; ///< or null
    Objects known;
    std::uint64_t build_count = 0; ///< grows
    BuildOptions options;

private:
    /// The common data of the instances of one object.
    struct Shape {
        std::shared_ptr<const Object> object;
        double largest_error = 0.0; ///< largest rounding error of its instances
    };
    struct Plan {
        std::uint32_t id;
        SnapshotObject shown;
        Shape* shape;
        Placement placement;
    };

    void plan_instances();
    void place_instances();
    void build_objects(const Progress& progress);
    void make_instances();

    std::unique_ptr<SceneSnapshot::Impl> next_;
    std::unordered_map<const void*, Shape> shapes_; ///< by the address of the isosurface or mesh
    std::vector<Plan> plans_;
};

} // namespace isospline
