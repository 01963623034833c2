// An object's primitives as Embree user geometry: the callbacks that isosurfaces and meshes share.
#pragma once

#include "isospline/scene/device.h"
#include "isospline/scene/embree_ray.h"
#include "isospline/scene/object.h"
#include "isospline/scene/packet_occlusion.h"
#include "isospline/util/check.h"

#include <bit>
#include <cstddef>
#include <limits>

namespace isospline {

/// Embree's callbacks for a class of objects that has
///
///     Box box(unsigned int primitive) const;             // wide enough for rays in single precision
///     void intersect_one(const RTCIntersectFunctionNArguments& arguments) const;
///     void intersect_packet(const RTCIntersectFunctionNArguments& arguments) const;
///     bool is_occluded(unsigned int primitive, RayQuery& query) const;
///     LaneMask occluded_lanes(unsigned int primitive, LaneMask active, PacketOcclusion& query) const;
///
/// No exception crosses Embree's frames: the query stores it.
template <typename Shape>
struct UserGeometry {
    /// A geometry of `count` primitives. The object must outlive it. Throws std::invalid_argument if there are more
    /// than Embree supports.
    static embree::GeometryHandle make(const Device& device, const Shape& shape, std::size_t count)
    {
        check_count("boxes of an object", count);
        embree::GeometryHandle geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_USER));
        device.check();
        rtcSetGeometryUserPrimitiveCount(geometry.get(), static_cast<unsigned int>(count));
        rtcSetGeometryUserData(geometry.get(), const_cast<Shape*>(&shape)); // no callback changes it
        rtcSetGeometryBoundsFunction(geometry.get(), set_bounds, nullptr);
        rtcSetGeometryIntersectFunction(geometry.get(), intersect);
        rtcSetGeometryOccludedFunction(geometry.get(), occlude);
        return geometry;
    }

private:
    static void set_bounds(const RTCBoundsFunctionArguments* arguments) noexcept
    {
        const auto& shape = *static_cast<const Shape*>(arguments->geometryUserPtr);
        const Box box = shape.box(arguments->primID);
        isospline::set_bounds(box, *arguments->bounds_o);
    }

    static void intersect(const RTCIntersectFunctionNArguments* arguments) noexcept
    {
        const auto& shape = *static_cast<const Shape*>(arguments->geometryUserPtr);
        float* const t_far = &RTCRayN_tfar(RTCRayHitN_RayN(arguments->rayhit, arguments->N), arguments->N, 0);
        static_cast<Query&>(*arguments->context).guard(t_far, arguments->N, [&] {
            if (arguments->N > 1)
                shape.intersect_packet(*arguments);
            else if (arguments->valid[0] == -1)
                shape.intersect_one(*arguments);
        });
    }

    static void occlude(const RTCOccludedFunctionNArguments* arguments) noexcept
    {
        const auto& shape = *static_cast<const Shape*>(arguments->geometryUserPtr);
        float* const t_far = &RTCRayN_tfar(arguments->ray, arguments->N, 0);
        static_cast<Query&>(*arguments->context).guard(t_far, arguments->N, [&] {
            LaneMask active = active_lanes(arguments->valid, arguments->N);
            if (arguments->N > 1)
                active =
                    shape.occluded_lanes(arguments->primID, active, static_cast<PacketOcclusion&>(*arguments->context));
            else if (active != 0 && !shape.is_occluded(arguments->primID, static_cast<RayQuery&>(*arguments->context)))
                active = 0;
            for (LaneMask rest = active; rest != 0; rest &= rest - 1u)
                t_far[std::countr_zero(rest)] = -std::numeric_limits<float>::infinity();
        });
    }
};

} // namespace isospline
