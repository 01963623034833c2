// The only file that depends on Embree's version: 3.13 and 4 behind the same names.
#pragma once

#if ISOSPLINE_EMBREE_VERSION_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <memory>
#include <type_traits>

namespace isospline::embree {

struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
    void operator()(RTCBVH bvh) const { rtcReleaseBVH(bvh); }
};

/// Owners of Embree's reference-counted objects.
using DeviceHandle = std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release>;
using SceneHandle = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release>;
using GeometryHandle = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, Release>;
using BvhHandle = std::unique_ptr<std::remove_pointer_t<RTCBVH>, Release>;

#if ISOSPLINE_EMBREE_VERSION_MAJOR >= 4

/// The context that a query passes to its callbacks. Derive from it to pass more.
using QueryContext = RTCRayQueryContext;

inline void initialize(QueryContext& context)
{
    rtcInitRayQueryContext(&context);
}

inline void intersect(RTCScene scene, QueryContext& context, RTCRayHit& ray_hit)
{
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &context;
    rtcIntersect1(scene, &ray_hit, &arguments);
}

inline void occluded(RTCScene scene, QueryContext& context, RTCRay& ray)
{
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = &context;
    rtcOccluded1(scene, &ray, &arguments);
}

/// A packet of 4, 8 or 16 coherent rays.
template <int Size>
inline void intersect_coherent(RTCScene scene, QueryContext& context, const int* valid, RTCRayHitNt<Size>& packet)
{
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &context;
    arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    if constexpr (Size == 16)
        rtcIntersect16(valid, scene, reinterpret_cast<RTCRayHit16*>(&packet), &arguments);
    else if constexpr (Size == 8)
        rtcIntersect8(valid, scene, reinterpret_cast<RTCRayHit8*>(&packet), &arguments);
    else
        rtcIntersect4(valid, scene, reinterpret_cast<RTCRayHit4*>(&packet), &arguments);
}

/// Whether each ray of such a packet is occluded. This is not slower without the flag for coherent rays, and with it
/// the traversal of Embree 3.13 does not end for some packets of shadow rays at a scene of instances.
template <int Size>
inline void occluded(RTCScene scene, QueryContext& context, const int* valid, RTCRayNt<Size>& packet)
{
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = &context;
    if constexpr (Size == 16)
        rtcOccluded16(valid, scene, reinterpret_cast<RTCRay16*>(&packet), &arguments);
    else if constexpr (Size == 8)
        rtcOccluded8(valid, scene, reinterpret_cast<RTCRay8*>(&packet), &arguments);
    else
        rtcOccluded4(valid, scene, reinterpret_cast<RTCRay4*>(&packet), &arguments);
}

#else

using QueryContext = RTCIntersectContext;

inline void initialize(QueryContext& context)
{
    rtcInitIntersectContext(&context);
}

inline void intersect(RTCScene scene, QueryContext& context, RTCRayHit& ray_hit)
{
    rtcIntersect1(scene, &context, &ray_hit);
}

inline void occluded(RTCScene scene, QueryContext& context, RTCRay& ray)
{
    rtcOccluded1(scene, &context, &ray);
}

template <int Size>
inline void intersect_coherent(RTCScene scene, QueryContext& context, const int* valid, RTCRayHitNt<Size>& packet)
{
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    if constexpr (Size == 16)
        rtcIntersect16(valid, scene, &context, reinterpret_cast<RTCRayHit16*>(&packet));
    else if constexpr (Size == 8)
        rtcIntersect8(valid, scene, &context, reinterpret_cast<RTCRayHit8*>(&packet));
    else
        rtcIntersect4(valid, scene, &context, reinterpret_cast<RTCRayHit4*>(&packet));
}

template <int Size>
inline void occluded(RTCScene scene, QueryContext& context, const int* valid, RTCRayNt<Size>& packet)
{
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT; // it may be coherent from another query
    if constexpr (Size == 16)
        rtcOccluded16(valid, scene, &context, reinterpret_cast<RTCRay16*>(&packet));
    else if constexpr (Size == 8)
        rtcOccluded8(valid, scene, &context, reinterpret_cast<RTCRay8*>(&packet));
    else
        rtcOccluded4(valid, scene, &context, reinterpret_cast<RTCRay4*>(&packet));
}

#endif

/// The widest packet that the device traverses without splitting it: 16, 8 or 4 rays.
inline int native_packet_size(RTCDevice device)
{
    if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED))
        return 16;
    return rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? 8 : 4;
}

} // namespace isospline::embree
