#include "isospline/trace/brick_trace.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/brick_trace.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/trace/brick_packet-inl.h"
#include "isospline/trace/brick_single-inl.h"
#include "isospline/trace/first_cells-inl.h"
#include "isospline/trace/leaf-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

BrickTracer tracer_of_target()
{
    return {trace_ray, trace_packet, trace_leaf, trace_packet_in_leaf, add_first_cells};
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(tracer_of_target);

BrickTracer brick_tracer()
{
    return HWY_DYNAMIC_DISPATCH(tracer_of_target)();
}

} // namespace isospline
#endif
