#include "isospline/scene/scene.h"

#include "isospline/scene/settling.h"
#include "isospline/scene/snapshot_builder.h"
#include "isospline/util/cancellable_mutex.h"
#include "isospline/util/error.h"
#include "isospline/util/fork.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
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

/// The object whose placement was checked last: often many instances of one object are added in a row.
struct CheckedObject {
    std::weak_ptr<const void> shown;
    LocalSpace local;
};

} // namespace

struct Scene::Impl {
    explicit Impl(const BuildOptions& options) : build_options(options) {}

    std::uint32_t add(PlacedObject given);
    /// Throws std::invalid_argument for a placement that is not valid in any scene.
    void check_alone(const PlacedObject& given, std::uint32_t id);
    /// Whether a snapshot shows the scene as it is; there may be a newer one, of the settled index.
    bool is_current(const SceneSnapshot& snapshot) const;
    std::shared_ptr<const SceneSnapshot> snapshot(const Progress& progress);
    std::shared_ptr<const SceneSnapshot> settle(const Progress& progress);
    /// The newest snapshot if it is current, or null.
    std::shared_ptr<const SceneSnapshot> current() const;
    /// Begins to settle a current snapshot if that pays. Returns the objects of a settling that is done.
    Objects settle_if_it_pays(const std::shared_ptr<const SceneSnapshot>& known);
    /// Builds a snapshot with the help of finished objects.
    std::shared_ptr<const SceneSnapshot> build(const Objects& finished, const Progress& progress);

    /// These need the mutex. Entries that a build is using do not change.
    const PlacedObject& entry(std::uint32_t id) const;
    Entries& entries_to_edit();

    const BuildOptions build_options;
    CancellableMutex build_mutex; ///< of the thread that builds a snapshot

    /// Guards all members below; held only for moments.
    std::mutex& mutex() const { return fork_safe_mutex(this); }

    std::shared_ptr<Entries> entries = std::make_shared<Entries>();
    std::uint32_t next_id = 0;
    std::uint64_t version = 1; ///< of the entries
    std::shared_ptr<const SceneSnapshot> newest;
    Objects left_over; ///< finished objects of a build that threw; the next build may use them
    std::uint64_t build_count = 0;
    std::shared_ptr<Settling> settling; ///< of the newest snapshot, or null
    CheckedObject checked;
};

void Scene::Impl::check_alone(const PlacedObject& given, std::uint32_t id)
{
    check_transform(given.transform);
    const ShownObject shown = shown_now(given.object);
    std::optional<LocalSpace> local;
    {
        const std::lock_guard lock(mutex());
        if (checked.shown.lock() == address(shown))
            local = checked.local;
    }
    if (!local) {
        local = make_object(shown)->local();
        const std::lock_guard lock(mutex());
        checked = {address(shown), *local};
    }
    isospline::check_alone(*local, given.transform, id);
}

const PlacedObject& Scene::Impl::entry(std::uint32_t id) const
{
    if (const auto found = entries->find(id); found != entries->end())
        return found->second;
    throw_invalid("geometry_id", "the geometry id of an object in the scene",
                  std::to_string(id) + (id < next_id ? ", which has been removed" : ""));
}

Entries& Scene::Impl::entries_to_edit()
{
    if (entries.use_count() > 1) // a build is using them
        entries = std::make_shared<Entries>(*entries);
    ++version;
    return *entries;
}

std::uint32_t Scene::Impl::add(PlacedObject given)
{
    std::uint32_t likely_id;
    {
        const std::lock_guard lock(mutex());
        likely_id = next_id;
    }
    check_alone(given, likely_id);
    const std::lock_guard lock(mutex());
    if (next_id == invalid_id)
        throw_invalid("object", "fewer than " + std::to_string(invalid_id) + " objects in the scene's lifetime",
                      next_id);
    entries_to_edit().emplace(next_id, std::move(given));
    return next_id++;
}

bool Scene::Impl::is_current(const SceneSnapshot& snapshot) const
{
    {
        const std::lock_guard lock(mutex());
        if (snapshot.impl_->version != version)
            return false;
    }
    const std::vector<SurfaceAtLevel>& surfaces = snapshot.impl_->surfaces;
    return std::all_of(surfaces.begin(), surfaces.end(),
                       [](const SurfaceAtLevel& known) { return known.surface->snapshot() == known.shown; });
}

std::shared_ptr<const SceneSnapshot> Scene::Impl::current() const
{
    std::unique_lock lock(mutex());
    std::shared_ptr<const SceneSnapshot> known = newest;
    lock.unlock();
    return known && is_current(*known) ? known : nullptr;
}

Objects Scene::Impl::settle_if_it_pays(const std::shared_ptr<const SceneSnapshot>& known)
{
    const SceneSnapshot::Impl& impl = *known->impl_;
    if (impl.settling_gain.load(std::memory_order_relaxed) < impl.settling_cost || impl.settling_cost == 0)
        return {};
    std::shared_ptr<Settling> of_known;
    {
        const std::lock_guard lock(mutex());
        if (newest != known)
            return {};
        if (!settling)
            settling = std::make_shared<Settling>(impl, build_options);
        of_known = settling;
    }
    if (of_known->state() == Settling::State::done)
        return of_known->objects();
    of_known->begin(known);
    return {};
}

std::shared_ptr<const SceneSnapshot> Scene::Impl::snapshot(const Progress& progress)
{
    std::shared_ptr<const SceneSnapshot> known = current();
    if (known && settle_if_it_pays(known).empty())
        return known;
    const CancellableMutex::Lock build_lock(build_mutex, progress);
    known = current();
    Objects settled = known ? settle_if_it_pays(known) : Objects();
    if (known && settled.empty()) // the previous thread has built it
        return known;
    return build(settled, progress);
}

std::shared_ptr<const SceneSnapshot> Scene::Impl::settle(const Progress& progress)
{
    const std::shared_ptr<const SceneSnapshot> known = snapshot(part_of(progress, 0.0, 0.1));
    if (known->impl_->settling_cost == 0)
        return known;
    const Objects settled = settled_objects(*known->impl_, build_options, part_of(progress, 0.1, 0.9));
    const CancellableMutex::Lock build_lock(build_mutex, progress);
    return build(settled, part_of(progress, 0.9, 1.0));
}

std::shared_ptr<const SceneSnapshot> Scene::Impl::build(const Objects& finished, const Progress& progress)
{
    SnapshotBuilder builder;
    builder.options = build_options;
    std::uint64_t built_version;
    std::uint32_t ids;
    {
        const std::lock_guard lock(mutex());
        builder.entries = entries;
        builder.before = newest;
        builder.known = finished;
        builder.known.insert(left_over.begin(), left_over.end());
        builder.build_count = build_count;
        built_version = version;
        ids = next_id;
    }
    const auto keep = [&](std::shared_ptr<const SceneSnapshot> built, Objects rest) {
        std::shared_ptr<Settling> of_before; // ends outside of the lock
        const std::lock_guard lock(mutex());
        if (built) {
            newest.swap(built);
            settling.swap(of_before);
        }
        left_over.swap(rest);
        build_count = builder.build_count;
    };
    try {
        std::unique_ptr<SceneSnapshot::Impl> built = builder.build(progress);
        built->version = built_version;
        built->next_id = ids;
        auto next = std::make_shared<const SceneSnapshot>(std::move(built));
        keep(next, {});
        return next;
    } catch (...) {
        keep(nullptr, std::move(builder.known));
        throw;
    }
}

Scene::Scene(const BuildOptions& options) : impl_(std::make_unique<Impl>(options))
{
}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

std::uint32_t Scene::add(std::shared_ptr<const Isosurface> surface, const glm::dmat4& transform, SeenBy seen_by)
{
    if (!surface)
        throw_invalid("surface", "an isosurface", "none");
    return impl_->add({std::move(surface), transform, seen_by});
}

std::uint32_t Scene::add(std::shared_ptr<const Mesh> mesh, const glm::dmat4& transform, SeenBy seen_by)
{
    if (!mesh)
        throw_invalid("mesh", "a mesh", "none");
    return impl_->add({std::move(mesh), transform, seen_by});
}

void Scene::remove(std::uint32_t geometry_id)
{
    Entries::node_type removed; // destroyed after the lock is released
    const std::lock_guard lock(impl_->mutex());
    static_cast<void>(impl_->entry(geometry_id));
    removed = impl_->entries_to_edit().extract(geometry_id);
}

void Scene::set_transform(std::uint32_t geometry_id, const glm::dmat4& transform)
{
    PlacedObject moved = object(geometry_id);
    moved.transform = transform;
    impl_->check_alone(moved, geometry_id);
    const std::lock_guard lock(impl_->mutex());
    static_cast<void>(impl_->entry(geometry_id));
    impl_->entries_to_edit().at(geometry_id).transform = transform;
}

void Scene::set_visibility(std::uint32_t geometry_id, SeenBy seen_by)
{
    const std::lock_guard lock(impl_->mutex());
    static_cast<void>(impl_->entry(geometry_id));
    impl_->entries_to_edit().at(geometry_id).seen_by = seen_by;
}

std::shared_ptr<const SceneSnapshot> Scene::snapshot(const Progress& progress, std::uint64_t settling_gain)
{
    if (settling_gain == 0)
        return impl_->snapshot(progress);
    std::shared_ptr<const SceneSnapshot> drafted = impl_->snapshot(part_of(progress, 0.0, 0.1));
    const SceneSnapshot::Impl& impl = *drafted->impl_;
    if (impl.settling_cost == 0 || impl.settling_gain + settling_gain < impl.settling_cost)
        return drafted;
    return impl_->settle(part_of(progress, 0.1, 1.0));
}

void Scene::share_built_objects(const Scene& other)
{
    const std::shared_ptr<const SceneSnapshot> built = other.impl_->current();
    if (!built)
        return;
    const std::lock_guard lock(impl_->mutex());
    for (const auto& instance : built->impl_->instances)
        impl_->left_over.emplace(address(instance->shown.object).get(), instance->object);
}

std::shared_ptr<const SceneSnapshot> Scene::settle(const Progress& progress)
{
    return impl_->settle(progress);
}

bool Scene::is_settled() const
{
    const std::shared_ptr<const SceneSnapshot> known = impl_->current();
    return known && known->impl_->settling_cost == 0;
}

bool Scene::is_current(const SceneSnapshot& snapshot) const
{
    return impl_->is_current(snapshot);
}

PlacedObject Scene::object(std::uint32_t geometry_id) const
{
    const std::lock_guard lock(impl_->mutex());
    return impl_->entry(geometry_id);
}

bool Scene::contains(std::uint32_t geometry_id) const
{
    const std::lock_guard lock(impl_->mutex());
    return impl_->entries->contains(geometry_id);
}

std::vector<std::uint32_t> Scene::ids() const
{
    const std::lock_guard lock(impl_->mutex());
    std::vector<std::uint32_t> ids;
    ids.reserve(impl_->entries->size());
    for (const auto& [id, entry] : *impl_->entries)
        ids.push_back(id);
    return ids;
}

const BuildOptions& Scene::build_options() const
{
    return impl_->build_options;
}

std::map<std::uint32_t, PlacedObject> Scene::objects() const
{
    const std::lock_guard lock(impl_->mutex());
    return *impl_->entries;
}

std::size_t Scene::count() const
{
    const std::lock_guard lock(impl_->mutex());
    return impl_->entries->size();
}

} // namespace isospline
