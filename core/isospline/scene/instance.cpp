#include "isospline/scene/instance.h"

#include "isospline/math/affine.h"
#include "isospline/util/check.h"

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <string>

namespace isospline {

namespace {

/// Products of three lengths, which tests of triangles compute, are finite in single precision.
constexpr double largest_length = 1e12;

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

glm::dmat4 moved(const glm::dmat4& local_to_world, const glm::dvec3& centre)
{
    return glm::translate(glm::dmat4(1.0), -centre) * local_to_world;
}

} // namespace

glm::dmat4 Instance::local_to_world() const
{
    return given.transform * object->local_to_object();
}

Box Instance::bounds() const
{
    return transform_box(local_to_world(), object->local_bounds());
}

Placement Instance::placed(const glm::dvec3& centre, double radius) const
{
    Placement placed;
    placed.transform = given.transform;
    placed.world_to_local = glm::inverse(local_to_world());
    placed.centred_to_local = glm::inverse(moved(local_to_world(), centre));
    placed.rounding_error = traversal_rounding_error(radius, placed.centred_to_local);

    const double scale = stretch(placed.centred_to_local);
    const double reach = radius * scale + glm::length(glm::dvec3(placed.centred_to_local[3]));
    for (const double length : {radius, scale, reach})
        if (!(length <= largest_length))
            throw_invalid("transform",
                          "sizes and distances of at most " + to_text(largest_length) +
                              ", in units of the world and of each object",
                          to_text(length) + " for geometry id " + std::to_string(id));
    return placed;
}

void Instance::update(Device& device, const glm::dvec3& centre)
{
    if (!geometry_) {
        geometry_.reset(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_INSTANCE));
        device.check();
    }
    const glm::mat4 single_precision(moved(local_to_world(), centre));
    rtcSetGeometryInstancedScene(geometry_.get(), object->scene());
    rtcSetGeometryTransform(geometry_.get(), 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, glm::value_ptr(single_precision));
    rtcCommitGeometry(geometry_.get());
    device.check();
}

void Instance::attach(Device& device, TopScene which, RTCScene top, bool visible)
{
    if (!visible)
        return detach(which, top);
    if (attached_[which])
        return;
    rtcAttachGeometryByID(top, geometry_.get(), slot);
    device.check();
    attached_[which] = true;
}

void Instance::detach(TopScene which, RTCScene top)
{
    if (attached_[which])
        rtcDetachGeometry(top, slot);
    attached_[which] = false;
}

} // namespace isospline
