#include "isospline/cell/intersectors_of_degrees.h"

// Vectors whose size is only known at run time cannot be array elements.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/cell/cubic_intersector.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/cell/intersector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

CellIntersector cubic(Method method)
{
    return intersector<3>(method);
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(cubic);

CellIntersector cubic_intersector(Method method)
{
    return HWY_DYNAMIC_DISPATCH(cubic)(method);
}

} // namespace isospline
#endif
