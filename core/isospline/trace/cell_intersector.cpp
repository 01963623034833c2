#include "isospline/trace/cell_intersector.h"

#include "isospline/trace/bracket.h"
#include "isospline/util/error.h"

#include <glm/geometric.hpp>

#include <bit>

#ifndef ISOSPLINE_TRACE_ONE_BY_ONE
#define ISOSPLINE_TRACE_ONE_BY_ONE
namespace isospline {
namespace {

using FirstRootFunction = std::optional<RootInCell> (*)(const CellBlock& cell, const LatticeRay& ray);
using AllRootsFunction = void (*)(const CellBlock& cell, const LatticeRay& ray, std::vector<CrossingInCell>& crossings);

/// All ways to ask, by one ray after the other.
template <FirstRootFunction first_root, AllRootsFunction all_roots>
constexpr CellIntersector one_by_one{
    first_root, [](const CellBlock& cell, const LatticeRay& ray) { return first_root(cell, ray).has_value(); },
    all_roots,
    [](const CellBlock& cell, const LatticeRayPacket& rays, const double* t_limit, LaneMask active, RootPacket& roots) {
        LaneMask found = 0;
        for (LaneMask rest = active; rest != 0; rest &= rest - 1u) {
            const int lane = std::countr_zero(rest);
            if (const auto root = first_root(cell, rays.ray(lane)); root && root->t <= t_limit[lane]) {
                found |= LaneMask{1} << lane;
                roots.set(lane, *root);
            }
        }
        return found;
    }};

} // namespace
} // namespace isospline
#endif

// Vectors whose size is known at run time only cannot be array elements.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/cell_intersector.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/trace/cell_packet-inl.h"
#include "isospline/trace/cell_single-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

template <int Degree>
constexpr CellIntersector exact_of_degree{SingleFirstRoot<Degree>, SingleAnyRoot<Degree>, SingleAllRoots<Degree>,
                                          PacketFirstRoots<Degree>};

template <int Degree>
constexpr CellIntersector reference_of_degree = one_by_one<ReferenceFirstRoot<Degree>, ReferenceAllRoots<Degree>>;

CellIntersector IntersectorOfDegree(int degree, bool reference)
{
    switch (degree) {
    case 1:
        return reference ? reference_of_degree<1> : exact_of_degree<1>;
    case 2:
        return reference ? reference_of_degree<2> : exact_of_degree<2>;
    default:
        return reference ? reference_of_degree<3> : exact_of_degree<3>;
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(IntersectorOfDegree);

namespace {

template <int Degree>
void bracket_all_roots(const CellBlock& cell, const LatticeRay& ray, std::vector<CrossingInCell>& crossings)
{
    if (const auto root = intersect_bracket<Degree>(cell, ray))
        crossings.push_back({*root, glm::dot(root->gradient, ray.direction) > 0.0});
}

template <int Degree>
CellIntersector intersector_of_degree(Method method)
{
    switch (method) {
    case Method::exact:
        return HWY_DYNAMIC_DISPATCH(IntersectorOfDegree)(Degree, false);
    case Method::reference:
        return HWY_DYNAMIC_DISPATCH(IntersectorOfDegree)(Degree, true);
    case Method::bracket:
        return one_by_one<intersect_bracket<Degree>, bracket_all_roots<Degree>>;
    }
    throw_invalid("method", "exact, reference or bracket", static_cast<int>(method));
}

} // namespace

CellIntersector cell_intersector(int degree, Method method)
{
    switch (degree) {
    case 1:
        return intersector_of_degree<1>(method);
    case 2:
        return intersector_of_degree<2>(method);
    case 3:
        return intersector_of_degree<3>(method);
    }
    throw_invalid("degree", "1, 2 or 3 for a surface", degree);
}

} // namespace isospline
#endif
