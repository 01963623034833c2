#include "isospline/scene/scene.h"

#include "isospline/math/affine.h"
#include "isospline/scene/isosurface_object.h"
#include "isospline/scene/mesh_object.h"
#include "isospline/scene/scene_impl.h"
#include "isospline/util/error.h"

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <string>

namespace isospline {

namespace {

/// Largest change of a local coordinate by a world vector of length one.
double stretch(const glm::dmat4& world_to_local)
{
    double largest = 0.0;
    for (int row = 0; row < 3; ++row)
        largest = std::max(
            largest, glm::length(glm::dvec3(world_to_local[0][row], world_to_local[1][row], world_to_local[2][row])));
    return largest;
}

/// Rounding error, in an object's local space, of a ray that Embree traverses in single precision.
///
/// In a scene of radius R about its centre, rays begin within 2 R of the centre and end within 2 R. Going to local
/// space, each coordinate is a sum of three products and a translation, of size up to 2 R m + T, m being the map's
/// stretch and T its translation: one rounding for each factor and one for each operation, at most six. The direction's
/// rounding, six more, grows over a length of at most 4 R.
double traversal_rounding_error(double radius, const glm::dmat4& centred_to_local)
{
    constexpr double unit_roundoff = 0x1p-24;
    const double reach = radius * stretch(centred_to_local);
    const glm::dvec3 translation(centred_to_local[3]);
    return 6.0 * unit_roundoff * (2.0 * reach + glm::length(translation) + 4.0 * reach);
}

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

} // namespace

Scene::Impl::Impl(BuildQuality quality) : device(quality), top(rtcNewScene(device.get()))
{
    rtcSetSceneFlags(top.get(), RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC | embree::query_filter_flag);
    device.check();
}

std::uint32_t Scene::Impl::add(std::unique_ptr<Object> object, PlacedObject given)
{
    check_transform(object->transform());
    objects.push_back(std::move(object));
    placed.push_back(std::move(given));
    return static_cast<std::uint32_t>(objects.size() - 1);
}

double Scene::Impl::rounding_error(const Object& object) const
{
    const glm::dmat4 centred_to_local = glm::inverse(object.local_to_world()) * glm::translate(glm::dmat4(1.0), centre);
    return traversal_rounding_error(radius, centred_to_local);
}

bool Scene::Impl::commit_is_due() const
{
    return committed_count != objects.size() || std::any_of(objects.begin(), objects.end(), [&](const auto& object) {
               return object->is_stale(rounding_error(*object));
           });
}

void Scene::Impl::require_commit() const
{
    if (commit_is_due())
        throw std::logic_error("the scene has changed: commit() it before casting rays");
}

void Scene::Impl::commit(const Progress& progress)
{
    const std::lock_guard lock(commit_mutex);
    if (!commit_is_due())
        return;
    bounds = Box();
    for (const auto& object : objects) {
        const Box box = transform_box(object->local_to_world(), object->local_bounds());
        if (!box.empty()) {
            bounds.extend(box.lower);
            bounds.extend(box.upper);
        }
    }
    centre = bounds.empty() ? glm::dvec3(0.0) : bounds.center();
    radius = bounds.empty() ? 0.0 : 0.5 * glm::length(bounds.size());
    const glm::dvec3 half_size = 0.5 * bounds.size() + 1e-3 * radius;
    centred_bounds = bounds.empty() ? Box() : Box{-half_size, half_size};

    for (std::size_t id = 0; id < objects.size(); ++id) {
        Object& object = *objects[id];
        const double error = rounding_error(object);
        if (object.is_stale(error))
            object.build(device, error, progress);
        object.place(device, top.get(), static_cast<std::uint32_t>(id), centre);
    }
    device.commit(top.get());
    committed_count = objects.size();
}

Scene::Scene(BuildQuality quality) : impl_(std::make_unique<Impl>(quality))
{
}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

std::uint32_t Scene::add(std::shared_ptr<const Isosurface> surface, const glm::dmat4& transform)
{
    return impl_->add(std::make_unique<IsosurfaceObject>(surface, transform), {surface, transform});
}

std::uint32_t Scene::add(std::shared_ptr<const Mesh> mesh, const glm::dmat4& transform)
{
    return impl_->add(std::make_unique<MeshObject>(mesh, transform), {mesh, transform});
}

void Scene::commit(const Progress& progress)
{
    impl_->commit(progress);
}

glm::dvec3 Scene::offset_position(const Hit& hit, const glm::dvec3& towards) const
{
    if (hit.geometry_id >= impl_->objects.size())
        throw_invalid("hit", "a geometry id below " + std::to_string(impl_->objects.size()), hit.geometry_id);
    const Object& object = *impl_->objects[hit.geometry_id];
    return object.offset_position(hit, towards, impl_->centre, impl_->rounding_error(object));
}

Box Scene::bounds() const
{
    return impl_->bounds;
}

const PlacedObject& Scene::object(std::uint32_t geometry_id) const
{
    return impl_->placed.at(geometry_id);
}

std::size_t Scene::count() const
{
    return impl_->objects.size();
}

std::size_t Scene::memory() const
{
    std::size_t bytes = impl_->device.memory();
    for (const auto& object : impl_->objects)
        bytes += object->memory();
    return bytes;
}

} // namespace isospline
