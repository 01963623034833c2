#include "isospline/scene/snapshot_builder.h"

#include "isospline/scene/isosurface_object.h"
#include "isospline/scene/mesh_object.h"

#include <algorithm>
#include <utility>

namespace isospline {

namespace {

using InstancesBySlot = std::vector<std::shared_ptr<const Instance>>;

/// An Embree scene of some instances.
template <typename IsIn>
embree::SceneHandle make_top(const InstancesBySlot& instances, const IsIn& is_in)
{
    const Device& device = Device::shared();
    embree::SceneHandle top(rtcNewScene(device.get()));
    device.check();
    rtcSetSceneFlags(top.get(), RTC_SCENE_FLAG_ROBUST);
    for (std::size_t slot = 0; slot < instances.size(); ++slot)
        if (is_in(*instances[slot]))
            rtcAttachGeometryByID(top.get(), instances[slot]->geometry.get(), static_cast<unsigned int>(slot));
    device.check();
    device.commit(top.get());
    return top;
}

/// Sets the scenes of what a kind of rays meets, but not the frame.
void set_scenes(const InstancesBySlot& instances, bool SeenBy::*sees, Met& met)
{
    const auto is_seen = [sees](const Instance& instance) { return instance.shown.seen_by.*sees; };
    const auto is_other = [&](const Instance& instance) {
        return is_seen(instance) && instance.object->with_stream() == nullptr;
    };
    met.top = make_top(instances, is_seen);
    bool has_others = false;
    for (std::uint32_t slot = 0; slot < instances.size(); ++slot) {
        has_others = has_others || is_other(*instances[slot]);
        if (is_seen(*instances[slot]) && !is_other(*instances[slot]))
            met.streams.push_back(slot);
    }
    if (met.streams.size() > Met::most_streams)
        met.streams.clear();
    if (has_others && !met.streams.empty())
        met.others = make_top(instances, is_other);
}

/// The frame of rays that meet the objects in a box. It is that of all objects, so that all rays are rounded in the
/// same way, unless that is much larger: the boxes of an isosurface would be wider for the sake of a ground that its
/// shadow rays do not meet, and could not be those of a scene without the ground.
RayFrame frame_for(const Box& met, const RayFrame& all)
{
    constexpr double much = 4.0;
    const RayFrame own(met, all.centre);
    return all.radius > much * own.radius ? own : all;
}

} // namespace

ShownObject shown_now(const std::variant<std::shared_ptr<const Isosurface>, std::shared_ptr<const Mesh>>& object)
{
    if (const auto* surface = std::get_if<std::shared_ptr<const Isosurface>>(&object))
        return (*surface)->snapshot();
    return std::get<std::shared_ptr<const Mesh>>(object);
}

std::shared_ptr<const void> address(const ShownObject& shown)
{
    return std::visit([](const auto& object) -> std::shared_ptr<const void> { return object; }, shown);
}

std::shared_ptr<Object> make_object(const ShownObject& shown)
{
    if (const auto* surface = std::get_if<std::shared_ptr<const IsosurfaceSnapshot>>(&shown))
        return std::make_shared<IsosurfaceObject>(*surface);
    return std::make_shared<MeshObject>(std::get<std::shared_ptr<const Mesh>>(shown));
}

void check_alone(const LocalSpace& local, const glm::dmat4& transform, std::uint32_t id)
{
    const RayFrame frame(placed_domain(local, transform));
    static_cast<void>(placed(local, transform, frame, frame.radius, id));
}

std::unique_ptr<SceneSnapshot::Impl> SnapshotBuilder::build(const Progress& progress)
{
    next_ = std::make_unique<SceneSnapshot::Impl>();
    if (before)
        for (const auto& instance : before->impl_->instances)
            known.emplace(address(instance->shown.object).get(), instance->object);
    plan_instances();
    place_instances();
    build_objects(progress);
    make_instances();
    next_->build_count = build_count;
    for (const auto& object : next_->objects)
        next_->settling_cost += object->settling_cost();
    return std::move(next_);
}

void SnapshotBuilder::plan_instances()
{
    std::unordered_map<const Isosurface*, std::shared_ptr<const IsosurfaceSnapshot>> surfaces;
    plans_.reserve(entries->size());
    for (const auto& [id, placed_object] : *entries) {
        SnapshotObject shown{{}, placed_object.transform, placed_object.seen_by};
        if (const auto* surface = std::get_if<std::shared_ptr<const Isosurface>>(&placed_object.object)) {
            std::shared_ptr<const IsosurfaceSnapshot>& at_level = surfaces[surface->get()];
            if (!at_level) {
                at_level = (*surface)->snapshot();
                next_->surfaces.push_back({*surface, at_level});
                next_->reads_sources |= at_level->volume().source() != nullptr;
            }
            shown.object = at_level;
        } else {
            shown.object = std::get<std::shared_ptr<const Mesh>>(placed_object.object);
        }
        const void* const what = address(shown.object).get();
        Shape& shape = shapes_[what];
        if (!shape.object) {
            const auto found = known.find(what);
            shape.object = found != known.end() ? found->second : make_object(shown.object);
        }
        plans_.push_back({id, std::move(shown), &shape, {}});
    }
}

void SnapshotBuilder::place_instances()
{
    Box all, of_camera, of_shadow;
    bool shadows_differ = false;
    for (const Plan& plan : plans_) {
        shadows_differ = shadows_differ || plan.shown.seen_by.camera != plan.shown.seen_by.shadow;
        const Box domain = placed_domain(plan.shape->object->local(), plan.shown.transform);
        all.extend(domain);
        if (plan.shown.seen_by.camera)
            of_camera.extend(domain);
        if (plan.shown.seen_by.shadow)
            of_shadow.extend(domain);
    }
    next_->frame = RayFrame(all);
    next_->by_camera.frame = frame_for(of_camera, next_->frame);
    if (shadows_differ)
        next_->by_shadow.emplace().frame = frame_for(of_shadow, next_->frame);
    for (Plan& plan : plans_) {
        Shape& shape = *plan.shape;
        const auto radius = [&](bool SeenBy::*sees) {
            return plan.shown.seen_by.*sees ? next_->met(sees).frame.radius : 0.0;
        };
        const double ray_radius = std::max(radius(&SeenBy::camera), radius(&SeenBy::shadow));
        plan.placement = placed(shape.object->local(), plan.shown.transform, next_->frame, ray_radius, plan.id);
        shape.largest_error = std::max(shape.largest_error, plan.placement.rounding_error);
    }
}

void SnapshotBuilder::build_objects(const Progress& progress)
{
    // Build an object for the instance that needs the widest boxes.
    for (const Plan& plan : plans_) {
        Shape& shape = *plan.shape;
        if (shape.object->is_built() && shape.object->fits(shape.largest_error))
            continue;
        const std::shared_ptr<Object> built = make_object(plan.shown.object);
        built->build(options, shape.largest_error, progress);
        shape.object = built;
        known[address(plan.shown.object).get()] = built;
        ++build_count;
    }
}

void SnapshotBuilder::make_instances()
{
    const EmbreeMemory embree_memory;
    Device::shared().forget_errors();
    const InstancesBySlot none;
    const auto& old_instances = before ? before->impl_->instances : none;
    auto old = old_instances.begin();
    const auto old_end = old_instances.end();
    next_->instances.reserve(plans_.size());
    for (Plan& plan : plans_) {
        const std::shared_ptr<const Object>& object = plan.shape->object;
        // An instance that has not moved keeps its geometry.
        while (old != old_end && (*old)->id < plan.id)
            ++old;
        const bool same = old != old_end && (*old)->id == plan.id && (*old)->is_same(*object, plan.placement);
        if (same && (*old)->shown.seen_by == plan.shown.seen_by) {
            next_->instances.push_back(*old);
        } else if (same) {
            auto instance = std::make_shared<Instance>(**old);
            instance->shown.seen_by = plan.shown.seen_by;
            next_->instances.push_back(std::move(instance));
        } else {
            next_->instances.push_back(std::make_shared<const Instance>(plan.id, object, std::move(plan.shown),
                                                                        plan.placement, next_->frame.centre));
        }
    }
    set_scenes(next_->instances, &SeenBy::camera, next_->by_camera);
    if (next_->by_shadow)
        set_scenes(next_->instances, &SeenBy::shadow, *next_->by_shadow);

    next_->top_memory = embree_memory.bytes() + plans_.size() * sizeof(Instance);
    for (const auto& [what, shape] : shapes_)
        next_->objects.push_back(shape.object);
}

} // namespace isospline
