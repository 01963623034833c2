#include "isospline/scene/instance.h"

#include "isospline/math/affine.h"
#include "isospline/util/check.h"

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace isospline {

namespace {

/// Small enough that products of three lengths, which triangle tests compute, are finite in single precision.
constexpr double largest_length = 1e12;

/// The largest change of a local coordinate by a world vector of length one.
double stretch(const glm::dmat4& world_to_local)
{
    double largest = 0.0;
    for (int row = 0; row < 3; ++row)
        largest = std::max(
            largest, glm::length(glm::dvec3(world_to_local[0][row], world_to_local[1][row], world_to_local[2][row])));
    return largest;
}

/// The smallest length in the world of an object's units, voxels or units of a mesh. The stretch of the inverse map is
/// not finite for the shortest ones.
double smallest_unit(const glm::dmat4& local_to_world, double stretch_of_inverse)
{
    double smallest = 1.0 / stretch_of_inverse;
    for (int axis = 0; axis < 3; ++axis) {
        const glm::dvec3 unit(local_to_world[axis]);
        smallest = std::fmin(smallest, std::hypot(unit.x, unit.y, unit.z));
    }
    return smallest;
}

/// Rounding error, in an object's local space, of a ray that Embree traverses in single precision. It covers that of a
/// ray that goes through a LeafTree.
///
/// In a scene of radius R around its centre, rays begin and end within 2 R of the centre. In local space, each
/// coordinate is a sum of three products and a translation. Its size is up to 2 R m + T, where m is the map's stretch
/// and T its translation. It has one rounding for each factor and one for each operation, at most six. The direction
/// has six more, whose effect grows over a length of at most 4 R.
double traversal_rounding_error(double radius, const glm::dmat4& centred_to_local)
{
    constexpr double unit_roundoff = 0x1p-24;
    const double reach = radius * stretch(centred_to_local);
    const glm::dvec3 translation(centred_to_local[3]);
    return 6.0 * unit_roundoff * (2.0 * reach + glm::length(translation) + 4.0 * reach);
}

} // namespace

Box placed_bounds(const Object& object, const glm::dmat4& transform)
{
    return transform_box(transform * object.local().to_object, object.bounds());
}

Box placed_domain(const LocalSpace& local, const glm::dmat4& transform)
{
    return transform_box(transform * local.to_object, local.domain);
}

Placement placed(const LocalSpace& local, const glm::dmat4& transform, const RayFrame& frame, double ray_radius,
                 std::uint32_t id)
{
    const glm::dmat4 local_to_world = transform * local.to_object;
    Placement placed;
    placed.transform = transform;
    placed.linear_inverse = glm::inverse(glm::dmat3(transform));
    placed.world_to_local = glm::inverse(local_to_world);
    placed.centred_to_local = centred_to_local(local_to_world, frame);
    placed.rounding_error = traversal_rounding_error(ray_radius, placed.centred_to_local);

    const std::string of_object = " for geometry id " + std::to_string(id);
    if (!(frame.radius <= largest_length))
        throw_invalid("objects", "all within a radius of " + to_text(largest_length) + " units of the world",
                      to_text(frame.radius) + of_object);
    const double scale = stretch(placed.centred_to_local);
    const double reach = frame.radius * scale + glm::length(glm::dvec3(placed.centred_to_local[3]));
    if (!(scale <= largest_length && reach <= largest_length)) {
        const std::string least = to_text(1.0 / largest_length);
        const std::string sizes =
            to_text(smallest_unit(local_to_world, scale)) + " in a scene of diameter " + to_text(2.0 * frame.radius);
        throw_invalid("objects",
                      "voxels, and units of meshes, of at least " + least + " in the world and " + least +
                          " of the scene's diameter",
                      sizes + of_object);
    }
    return placed;
}

Instance::Instance(std::uint32_t geometry_id, std::shared_ptr<const Object> placed_object, SnapshotObject shown_object,
                   const Placement& object_placement, const glm::dvec3& centre)
    : id(geometry_id), object(std::move(placed_object)), shown(std::move(shown_object)), placement(object_placement)
{
    const Device& device = Device::shared();
    geometry.reset(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_INSTANCE), embree::Release());
    device.check();
    const glm::mat4 single_precision(glm::translate(glm::dmat4(1.0), -centre) * shown.transform *
                                     object->local().to_object);
    rtcSetGeometryInstancedScene(geometry.get(), object->scene());
    rtcSetGeometryTransform(geometry.get(), 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, glm::value_ptr(single_precision));
    rtcCommitGeometry(geometry.get());
    device.check();
}

bool Instance::is_same(const Object& other_object, const Placement& other_placement) const
{
    return object.get() == &other_object && placement.transform == other_placement.transform &&
           placement.centred_to_local == other_placement.centred_to_local &&
           placement.rounding_error == other_placement.rounding_error;
}

} // namespace isospline
