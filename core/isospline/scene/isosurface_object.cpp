#include "isospline/scene/isosurface_object.h"

#include "isospline/math/affine.h"
#include "isospline/scene/ray_query.h"
#include "isospline/trace/surface_hit.h"
#include "isospline/trace/tight_box.h"
#include "isospline/util/error.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace isospline {

IsosurfaceObject::IsosurfaceObject(std::shared_ptr<const Isosurface> surface, const glm::dmat4& transform)
    : Object(transform), surface_(std::move(surface)),
      intersector_(cell_intersector(surface_->volume().degree(), surface_->options().method))
{
}

Box IsosurfaceObject::local_bounds() const
{
    Box box;
    for (const Cell& cell : surface_->shell().cells()) {
        const glm::dvec3 lower(cell.x, cell.y, cell.z);
        box.lower = glm::min(box.lower, lower);
        box.upper = glm::max(box.upper, lower + 1.0);
    }
    return box;
}

bool IsosurfaceObject::is_stale(double rounding_error_local) const
{
    // Margins are built with room to grow, so that adding objects to a scene does not rebuild all others.
    return built_version_ != surface_->version() || rounding_error_local > box_margin_ ||
           rounding_error_local < box_margin_ / 16.0;
}

void IsosurfaceObject::build(Device& device, double rounding_error_local, const Progress& progress)
{
    box_margin_ = 2.0 * rounding_error_local;
    built_version_ = 0;
    embree::GeometryHandle geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_USER));
    rtcSetGeometryUserPrimitiveCount(geometry.get(), static_cast<unsigned int>(surface_->shell().count()));
    rtcSetGeometryUserData(geometry.get(), this);
    rtcSetGeometryBoundsFunction(geometry.get(), bounds_function, nullptr);
    rtcSetGeometryIntersectFunction(geometry.get(), intersect_function);
    rtcSetGeometryOccludedFunction(geometry.get(), occluded_function);
    build_scene(device, geometry.get(), progress);
    built_version_ = surface_->version();
}

void IsosurfaceObject::complete(Hit& hit, const Ray& ray_world) const
{
    const Cell& cell = surface_->shell().cells()[hit.primitive_id];
    hit.position = ray_world.at(hit.t);
    const glm::dvec3 position_lattice = transform_point(world_to_local(), hit.position);
    set_surface_normal(hit, *surface_, cell, position_lattice, world_to_local());
}

std::optional<double> IsosurfaceObject::intersect(embree::QueryContext& context, unsigned int primitive,
                                                  float t_far) const
{
    auto& query = static_cast<RayQuery&>(context);
    std::optional<LatticeRay>& in_lattice =
        query.in_lattice(context.instID[0], centred_to_local(), surface_->clip_lattice());
    if (!in_lattice)
        return std::nullopt;

    // The ray ends at the nearest root so far, kept exactly, or at the nearest triangle.
    LatticeRay& ray = *in_lattice;
    ray.t_far = std::min({ray.t_far, query.t_hit, static_cast<double>(t_far)});
    const CellBlock cell(surface_->volume(), surface_->threshold(), surface_->shell().cells()[primitive]);
    const std::optional<double> t = intersector_(cell, ray);
    if (t)
        query.t_hit = *t;
    return t;
}

void IsosurfaceObject::bounds_function(const RTCBoundsFunctionArguments* arguments)
{
    const auto& self = *static_cast<const IsosurfaceObject*>(arguments->geometryUserPtr);
    const Isosurface& surface = *self.surface_;
    const CellBlock cell(surface.volume(), surface.threshold(), surface.shell().cells()[arguments->primID]);
    Box box;
    switch (surface.volume().degree()) {
    case 1:
        box = tight_box<1>(cell);
        break;
    case 2:
        box = tight_box<2>(cell);
        break;
    case 3:
        box = tight_box<3>(cell);
        break;
    }

    const auto margin = static_cast<float>(self.box_margin_);
    RTCBounds& bounds = *arguments->bounds_o;
    bounds.lower_x = static_cast<float>(box.lower.x) - margin;
    bounds.lower_y = static_cast<float>(box.lower.y) - margin;
    bounds.lower_z = static_cast<float>(box.lower.z) - margin;
    bounds.upper_x = static_cast<float>(box.upper.x) + margin;
    bounds.upper_y = static_cast<float>(box.upper.y) + margin;
    bounds.upper_z = static_cast<float>(box.upper.z) + margin;
}

void IsosurfaceObject::intersect_function(const RTCIntersectFunctionNArguments* arguments)
{
    ISOSPLINE_ASSERT(arguments->N, ==, 1u);
    if (arguments->valid[0] != -1)
        return;
    const auto& self = *static_cast<const IsosurfaceObject*>(arguments->geometryUserPtr);
    auto& [ray, hit] = *reinterpret_cast<RTCRayHit*>(arguments->rayhit);
    const std::optional<double> t = self.intersect(*arguments->context, arguments->primID, ray.tfar);
    if (!t)
        return;
    // Rounded up: the root itself stays within the ray.
    ray.tfar = std::nextafter(static_cast<float>(*t), std::numeric_limits<float>::infinity());
    hit.Ng_x = hit.Ng_y = hit.Ng_z = 0.0f;
    hit.u = hit.v = 0.0f;
    hit.geomID = 0;
    hit.primID = arguments->primID;
    hit.instID[0] = arguments->context->instID[0];
}

void IsosurfaceObject::occluded_function(const RTCOccludedFunctionNArguments* arguments)
{
    ISOSPLINE_ASSERT(arguments->N, ==, 1u);
    if (arguments->valid[0] != -1)
        return;
    const auto& self = *static_cast<const IsosurfaceObject*>(arguments->geometryUserPtr);
    auto& ray = *reinterpret_cast<RTCRay*>(arguments->ray);
    if (self.intersect(*arguments->context, arguments->primID, ray.tfar))
        ray.tfar = -std::numeric_limits<float>::infinity();
}

} // namespace isospline
