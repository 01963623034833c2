#include "isospline/scene/scene.h"

#include "isospline/math/affine.h"
#include "isospline/scene/isosurface_object.h"
#include "isospline/scene/mesh_object.h"
#include "isospline/scene/scene_impl.h"
#include "isospline/util/error.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <variant>

namespace isospline {

namespace {

void check_transform(const glm::dmat4& transform)
{
    bool finite = true;
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
            finite = finite && std::isfinite(transform[column][row]);
    if (!finite)
        throw_invalid("transform", "finite numbers", "one that is not finite");
    if (transform[0][3] != 0.0 || transform[1][3] != 0.0 || transform[2][3] != 0.0 || transform[3][3] != 1.0)
        throw_invalid("transform", "an affine map, of last row (0, 0, 0, 1)", "another last row");
    const glm::dmat3 linear(transform);
    const double volume = glm::length(linear[0]) * glm::length(linear[1]) * glm::length(linear[2]);
    const double determinant = glm::determinant(linear);
    if (!(std::abs(determinant) > 1e-12 * volume))
        throw_invalid("transform", "an invertible map", "determinant " + std::to_string(determinant));
}

glm::dvec3 centre_of(const Box& box)
{
    return box.empty() ? glm::dvec3(0.0) : box.center();
}

double radius_of(const Box& box)
{
    return box.empty() ? 0.0 : 0.5 * glm::length(box.size());
}

/// Tells early what is wrong with an instance in any scene.
void check_alone(const Instance& instance)
{
    const Box bounds = instance.bounds();
    static_cast<void>(instance.placed(centre_of(bounds), radius_of(bounds)));
}

const void* address(const PlacedObject& placed)
{
    return std::visit([](const auto& object) -> const void* { return object.get(); }, placed.object);
}

std::shared_ptr<Object> make_object(const PlacedObject& placed)
{
    if (const auto* surface = std::get_if<std::shared_ptr<const Isosurface>>(&placed.object))
        return std::make_shared<IsosurfaceObject>(*surface);
    return std::make_shared<MeshObject>(std::get<std::shared_ptr<const Mesh>>(placed.object));
}

} // namespace

Scene::Impl::Impl(BuildQuality quality) : device(quality)
{
    for (embree::SceneHandle& top : tops) {
        top.reset(rtcNewScene(device.get()));
        rtcSetSceneFlags(top.get(), RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC | embree::query_filter_flag);
        device.check();
        device.commit(top.get());
    }
    seen_by_shadows = tops[camera_top].get();
}

std::uint32_t Scene::Impl::add(PlacedObject given)
{
    check_transform(given.transform);
    const std::unique_lock lock(mutex);
    const std::lock_guard instance_lock(instance_mutex);
    ISOSPLINE_ASSERT(next_id, <, invalid_id);
    const auto known = objects.find(address(given));
    std::shared_ptr<Object> object = known == objects.end() ? make_object(given) : known->second;
    auto added = std::make_unique<Instance>();
    added->id = next_id;
    added->object = std::move(object);
    added->given = std::move(given);
    check_alone(*added);
    if (free_slots.empty()) {
        free_slots.push_back(static_cast<std::uint32_t>(instances.size()));
        instances.emplace_back();
    }
    added->slot = free_slots.back();
    objects[address(added->given)] = added->object;
    instance_of_id[next_id] = added.get();
    free_slots.pop_back();
    instances[added->slot] = std::move(added);
    has_changed = true;
    return next_id++;
}

void Scene::Impl::remove(std::uint32_t id)
{
    const std::unique_lock lock(mutex);
    const std::lock_guard instance_lock(instance_mutex);
    Instance& removed = instance(id, "geometry_id");
    free_slots.push_back(removed.slot);
    for (const TopScene which : {camera_top, shadow_top})
        removed.detach(which, tops[which].get());
    if (removed.object.use_count() == 2) // this instance and the list of objects
        objects.erase(address(removed.given));
    instance_of_id.erase(id);
    instances[removed.slot].reset();
    has_changed = true;
}

Instance* Scene::Impl::find(std::uint32_t id) const
{
    const auto found = instance_of_id.find(id);
    return found == instance_of_id.end() ? nullptr : found->second;
}

Instance& Scene::Impl::instance(std::uint32_t id, const char* parameter) const
{
    if (Instance* const found = find(id))
        return *found;
    throw_invalid(parameter, "the geometry id of an object in the scene",
                  std::to_string(id) + (id < next_id ? ", which has been removed" : ""));
}

bool Scene::Impl::commit_is_due() const
{
    return has_changed ||
           std::any_of(objects.begin(), objects.end(), [](const auto& item) { return item.second->has_changed(); });
}

void Scene::Impl::require_commit() const
{
    if (commit_is_due())
        throw std::logic_error("the scene has changed: commit() it before casting rays");
}

void Scene::Impl::commit(const Progress& progress)
{
    const std::unique_lock lock(mutex);
    if (!commit_is_due())
        return;
    has_changed = true; // until all is done: what throws below leaves the scene to the next commit

    bounds = Box();
    for (const auto& [id, instance] : instance_of_id)
        if (const Box box = instance->bounds(); !box.empty()) {
            bounds.extend(box.lower);
            bounds.extend(box.upper);
        }
    centre = centre_of(bounds);
    const double radius = radius_of(bounds);
    const glm::dvec3 half_size = 0.5 * bounds.size() + 1e-3 * radius;
    centred_bounds = bounds.empty() ? Box() : Box{-half_size, half_size};

    // An object is built for the instance that needs the widest boxes.
    std::unordered_map<const Object*, double> largest_error;
    bool shadows_differ = false;
    for (const auto& [id, instance] : instance_of_id) {
        instance->placement = instance->placed(centre, radius);
        double& error = largest_error[instance->object.get()];
        error = std::max(error, instance->placement.rounding_error);
        const SeenBy& seen_by = instance->given.seen_by;
        shadows_differ = shadows_differ || seen_by.camera != seen_by.shadow;
    }
    for (const auto& [id, instance] : instance_of_id) {
        Object& object = *instance->object;
        if (const double error = largest_error[&object]; object.is_stale(error)) {
            object.build(device, error, progress);
            ++build_count;
        }
    }

    // Shadow rays have a top scene of their own only where they see other objects than the camera does.
    for (const auto& [id, instance] : instance_of_id) {
        const SeenBy& seen_by = instance->given.seen_by;
        instance->update(device, centre);
        instance->attach(device, camera_top, tops[camera_top].get(), seen_by.camera);
        instance->attach(device, shadow_top, tops[shadow_top].get(), shadows_differ && seen_by.shadow);
    }
    for (const embree::SceneHandle& top : tops)
        device.commit(top.get());
    seen_by_shadows = tops[shadows_differ ? shadow_top : camera_top].get();
    has_changed = false;
}

Scene::Scene(BuildQuality quality) : impl_(std::make_unique<Impl>(quality))
{
}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

std::uint32_t Scene::add(std::shared_ptr<const Isosurface> surface, const glm::dmat4& transform, SeenBy seen_by)
{
    return impl_->add({std::move(surface), transform, seen_by});
}

std::uint32_t Scene::add(std::shared_ptr<const Mesh> mesh, const glm::dmat4& transform, SeenBy seen_by)
{
    return impl_->add({std::move(mesh), transform, seen_by});
}

void Scene::remove(std::uint32_t geometry_id)
{
    impl_->remove(geometry_id);
}

void Scene::set_transform(std::uint32_t geometry_id, const glm::dmat4& transform)
{
    check_transform(transform);
    const std::unique_lock lock(impl_->mutex);
    const std::lock_guard instance_lock(impl_->instance_mutex);
    Instance& instance = impl_->instance(geometry_id, "geometry_id");
    const glm::dmat4 before = std::exchange(instance.given.transform, transform);
    try {
        check_alone(instance);
    } catch (...) {
        instance.given.transform = before;
        throw;
    }
    impl_->has_changed = true;
}

void Scene::set_visibility(std::uint32_t geometry_id, SeenBy seen_by)
{
    const std::unique_lock lock(impl_->mutex);
    const std::lock_guard instance_lock(impl_->instance_mutex);
    impl_->instance(geometry_id, "geometry_id").given.seen_by = seen_by;
    impl_->has_changed = true;
}

void Scene::commit(const Progress& progress)
{
    impl_->commit(progress);
}

std::shared_lock<std::shared_mutex> Scene::hold(const Progress& progress)
{
    while (true) {
        std::shared_lock lock(impl_->mutex);
        if (!impl_->commit_is_due())
            return lock;
        lock.unlock();
        impl_->commit(progress);
    }
}

std::shared_lock<std::shared_mutex> Scene::hold_committed() const
{
    std::shared_lock lock(impl_->mutex);
    impl_->require_commit();
    return lock;
}

glm::dvec3 Scene::offset_position(const Hit& hit, const glm::dvec3& towards) const
{
    const Instance& instance = impl_->instance(hit.geometry_id, "hit");
    return instance.object->offset_position(hit, towards, impl_->centre, instance.placement);
}

Box Scene::bounds() const
{
    return impl_->bounds;
}

PlacedObject Scene::object(std::uint32_t geometry_id) const
{
    const std::lock_guard lock(impl_->instance_mutex);
    return impl_->instance(geometry_id, "geometry_id").given;
}

bool Scene::contains(std::uint32_t geometry_id) const
{
    const std::lock_guard lock(impl_->instance_mutex);
    return impl_->find(geometry_id) != nullptr;
}

std::vector<std::uint32_t> Scene::ids() const
{
    const std::lock_guard lock(impl_->instance_mutex);
    std::vector<std::uint32_t> ids;
    for (const auto& [id, instance] : impl_->instance_of_id)
        ids.push_back(id);
    return ids;
}

std::size_t Scene::count() const
{
    const std::lock_guard lock(impl_->instance_mutex);
    return impl_->instance_of_id.size();
}

std::uint64_t Scene::build_count() const
{
    return impl_->build_count;
}

std::size_t Scene::memory() const
{
    std::size_t bytes = impl_->device.memory() + impl_->instance_of_id.size() * sizeof(Instance);
    for (const auto& [address, object] : impl_->objects)
        bytes += object->memory();
    return bytes;
}

} // namespace isospline
