// The one place that knows of Embree's versions: 3.13 and 4 behind the same few names.
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
};

/// Owners of Embree's reference-counted objects.
using DeviceHandle = std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release>;
using SceneHandle = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release>;
using GeometryHandle = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, Release>;

#if ISOSPLINE_EMBREE_VERSION_MAJOR >= 4

/// What a query carries to its callbacks; derive from it to carry more.
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

#endif

} // namespace isospline::embree
