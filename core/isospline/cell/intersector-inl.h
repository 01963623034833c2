// The intersectors of cells of one degree. Included once for each SIMD target.
#include "isospline/cell/bracket-inl.h"
#include "isospline/cell/intersector.h"
#include "isospline/cell/packet-inl.h"
#include "isospline/cell/single_ray-inl.h"

#include <glm/geometric.hpp>

#include <bit>

#if defined(ISOSPLINE_CELL_INTERSECTOR_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_INTERSECTOR_INL_H
#undef ISOSPLINE_CELL_INTERSECTOR_INL_H
#else
#define ISOSPLINE_CELL_INTERSECTOR_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

using FirstRootFunction = std::optional<RootInCell> (*)(const CellCoefficients& cell, const LatticeRay& ray);

template <FirstRootFunction first_root>
bool any_root_of(const CellCoefficients& cell, const LatticeRay& ray)
{
    return first_root(cell, ray).has_value();
}

// One ray after the other.
template <FirstRootFunction first_root>
LaneMask first_roots_of(const CellCoefficients& cell, const LatticeRayPacket& rays, const double* t_limit,
                        LaneMask active, RootPacket& roots)
{
    LaneMask found = 0;
    for (LaneMask rest = active; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        if (const auto root = first_root(cell, rays.ray(lane)); root && root->t <= t_limit[lane]) {
            found |= LaneMask{1} << lane;
            roots.set(lane, *root);
        }
    }
    return found;
}

template <int Degree>
void bracket_all_roots(const CellCoefficients& cell, const LatticeRay& ray, std::vector<CrossingInCell>& crossings)
{
    if (const auto root = bracket_first_root<Degree>(cell, ray))
        crossings.push_back({*root, glm::dot(root->gradient, ray.direction) > 0.0});
}

template <int Degree>
CellIntersector intersector(Method method)
{
    constexpr int n = Degree;
    switch (method) {
    case Method::exact:
        return {exact_first_root<n>, exact_any_root<n>, exact_all_roots<n>, exact_first_roots<n>};
    case Method::reference:
        return {reference_first_root<n>, any_root_of<reference_first_root<n>>, reference_all_roots<n>,
                first_roots_of<reference_first_root<n>>};
    default:
        return {bracket_first_root<n>, any_root_of<bracket_first_root<n>>, bracket_all_roots<n>,
                first_roots_of<bracket_first_root<n>>};
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
