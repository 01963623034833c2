#include "isospline/scene/scene_snapshot.h"

#include "isospline/scene/scene_snapshot_impl.h"
#include "isospline/util/error.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

namespace isospline {

const Instance* SceneSnapshot::Impl::find(std::uint32_t id) const
{
    const auto found =
        std::lower_bound(instances.begin(), instances.end(), id,
                         [](const auto& instance, std::uint32_t wanted) { return instance->id < wanted; });
    return found == instances.end() || (*found)->id != id ? nullptr : found->get();
}

const Instance& SceneSnapshot::Impl::instance(std::uint32_t id, const char* parameter) const
{
    if (const Instance* const found = find(id))
        return *found;
    throw_invalid(parameter, "the geometry id of an object in the scene",
                  std::to_string(id) + (id < next_id ? ", which has been removed" : ""));
}

Traversal SceneSnapshot::Impl::traversal(bool SeenBy::*sees) const
{
    const Met& of_rays = met(sees);
    const auto is_seen = [sees](const auto& instance) { return instance->shown.seen_by.*sees; };
    const auto only = std::find_if(instances.begin(), instances.end(), is_seen);
    if (only == instances.end() || std::find_if(only + 1, instances.end(), is_seen) != instances.end())
        return {of_rays.top.get(), nullptr, 0, of_rays};
    return {(*only)->object->scene(), only->get(), static_cast<std::uint32_t>(only - instances.begin()), of_rays};
}

SceneSnapshot::SceneSnapshot(std::unique_ptr<const Impl> impl) : impl_(std::move(impl))
{
}
SceneSnapshot::~SceneSnapshot() = default;

glm::dvec3 SceneSnapshot::offset_position(const Hit& hit, const glm::dvec3& towards) const
{
    const Instance& instance = impl_->instance(hit.geometry_id, "hit");
    return instance.object->offset_position(hit, towards, impl_->frame, instance.placement);
}

const RayCoherence& SceneSnapshot::Impl::coherence(bool SeenBy::*sees) const
{
    Lazy<RayCoherence>& known = sees == &SeenBy::camera ? camera_coherence : shadow_coherence;
    return known.get({}, [&] { return RayCoherence(*this, sees); });
}

const RayCoherence& SceneSnapshot::coherence(bool SeenBy::*sees) const
{
    return impl_->coherence(sees);
}

Box SceneSnapshot::bounds() const
{
    Box bounds;
    for (const auto& instance : impl_->instances)
        bounds.extend(placed_bounds(*instance->object, instance->shown.transform));
    return bounds;
}

std::vector<double> SceneSnapshot::reach(std::span<const glm::dvec3> directions, const Progress& progress) const
{
    std::vector<double> reach(directions.size(), -std::numeric_limits<double>::infinity());
    std::vector<glm::dvec3> directions_local(directions.size());
    for (const auto& instance : impl_->instances) {
        if (!instance->shown.seen_by.camera)
            continue;
        const glm::dmat4 local_to_world = instance->shown.transform * instance->object->local().to_object;
        const glm::dvec3 translation(local_to_world[3]);
        for (std::size_t i = 0; i < directions.size(); ++i)
            directions_local[i] = glm::transpose(glm::dmat3(local_to_world)) * directions[i];
        const std::vector<double> of_object = instance->object->reach(directions_local, progress);
        for (std::size_t i = 0; i < directions.size(); ++i)
            reach[i] = std::max(reach[i], of_object[i] + glm::dot(directions[i], translation));
    }
    return reach;
}

const SnapshotObject& SceneSnapshot::object(std::uint32_t geometry_id) const
{
    return impl_->instance(geometry_id, "geometry_id").shown;
}

bool SceneSnapshot::contains(std::uint32_t geometry_id) const
{
    return impl_->find(geometry_id) != nullptr;
}

std::vector<std::uint32_t> SceneSnapshot::ids() const
{
    std::vector<std::uint32_t> ids;
    ids.reserve(impl_->instances.size());
    for (const auto& instance : impl_->instances)
        ids.push_back(instance->id);
    return ids;
}

bool SceneSnapshot::reads_sources() const
{
    return impl_->reads_sources;
}

std::uint64_t SceneSnapshot::build_count() const
{
    return impl_->build_count;
}

std::size_t SceneSnapshot::memory() const
{
    std::size_t bytes = impl_->top_memory;
    for (const auto& object : impl_->objects)
        bytes += object->memory();
    return bytes;
}

} // namespace isospline
