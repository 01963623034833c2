// From what users have put into a scene to a snapshot of it.
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

/// What users have put into a scene, by geometry id.
using Entries = std::map<std::uint32_t, PlacedObject>;

/// Objects by the address of what they show.
using Objects = std::unordered_map<const void*, std::shared_ptr<const Object>>;

/// An object as it is now.
ShownObject shown_now(const std::variant<std::shared_ptr<const Isosurface>, std::shared_ptr<const Mesh>>& object);

/// What is shown, whatever it is.
std::shared_ptr<const void> address(const ShownObject& shown);

/// An object that is yet to be built.
std::shared_ptr<Object> make_object(const ShownObject& shown);

/// Throws std::invalid_argument for a placement that does not do in any scene.
void check_alone(const LocalSpace& local, const glm::dmat4& transform, std::uint32_t id);

/// Makes one snapshot.
struct SnapshotBuilder {
    /// Builds what is neither part of the snapshot before nor among the known objects, to which it is added: what has
    /// been built when this throws is there for the next builder.
    std::unique_ptr<SceneSnapshot::Impl> build(const Progress& progress);

    std::shared_ptr<const Entries> entries;
    std::shared_ptr<const SceneSnapshot> before; ///< or null
    Objects known;
    std::uint64_t build_count = 0; ///< grows
    BuildOptions options;

private:
    /// What the instances of one object have in common.
    struct Shape {
        std::shared_ptr<const Object> object;
        double largest_error = 0.0; ///< of the rounding errors of its instances
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
    std::unordered_map<const void*, Shape> shapes_; ///< by the address of what they show
    std::vector<Plan> plans_;
};

} // namespace isospline
