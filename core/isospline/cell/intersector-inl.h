// The intersectors of cells of one degree. Included once for each SIMD target.
#include "isospline/cell/bracket-inl.h"
#include "isospline/cell/intersector.h"
#include "isospline/cell/packet_crossings-inl.h"
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
template <int Degree, FirstRootFunction first_root>
LaneMask first_roots_of(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays,
                        const double* t_limit, RootPacket& roots)
{
    LaneMask found = 0;
    for (LaneMask rest = cells.lanes; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const LatticeRay ray = rays.ray(lane);
        const auto root = cells.are_copied
                              ? first_root(CellOfLane<Degree>(cells, threshold, lane), ray)
                              : first_root(CellCoefficients(cells.only, threshold, cells.lower_of_only), ray);
        if (root && root->t <= t_limit[lane]) {
            found |= LaneMask{1} << lane;
            roots.set(lane, *root);
        }
    }
    return found;
}

template <int Degree, FirstRootFunction first_root>
LaneMask any_roots_of(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays)
{
    RootPacket roots;
    return first_roots_of<Degree, first_root>(cells, threshold, rays, rays.t_far, roots);
}

template <int Degree>
void bracket_all_roots(const CellCoefficients& cell, const LatticeRay& ray, std::vector<CrossingInCell>& crossings)
{
    if (const auto root = bracket_first_root<Degree>(cell, ray))
        crossings.push_back({*root, glm::dot(root->gradient, ray.direction) > 0.0});
}

using AllRootsFunction = void (*)(const CellCoefficients& cell, const LatticeRay& ray,
                                  std::vector<CrossingInCell>& crossings);

// One ray after the other.
template <int Degree, AllRootsFunction all_roots>
void visit_roots_of(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays,
                    const RootVisitor& visitor)
{
    std::vector<CrossingInCell> crossings;
    for (LaneMask rest = cells.lanes; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const LatticeRay ray = rays.ray(lane);
        crossings.clear();
        if (cells.are_copied)
            all_roots(CellOfLane<Degree>(cells, threshold, lane), ray, crossings);
        else
            all_roots(CellCoefficients(cells.only, threshold, cells.lower_of_only), ray, crossings);
        for (const CrossingInCell& crossing : crossings)
            visitor.visit(visitor.context, lane, crossing, ray.inside_cell(cells.lower_of(lane)).t_near);
    }
}

template <int Degree, AllRootsFunction all_roots>
LaneMask count_roots_of(const CandidateCells& cells, double threshold, const LatticeRayPacket& rays,
                        std::uint8_t* counts)
{
    struct Found {
        std::uint8_t* counts;
        LaneMask lanes;
    } found{counts, 0};
    const auto count = [](void* context, int lane, const CrossingInCell&, double) {
        Found& of = *static_cast<Found*>(context);
        const LaneMask bit = LaneMask{1} << lane;
        of.counts[lane] = static_cast<std::uint8_t>((of.lanes & bit) != 0 ? of.counts[lane] + 1 : 1);
        of.lanes |= bit;
    };
    visit_roots_of<Degree, all_roots>(cells, threshold, rays, {count, &found});
    return found.lanes;
}

template <int Degree>
CellIntersector intersector(Method method)
{
    constexpr int n = Degree;
    switch (method) {
    case Method::exact:
        return {exact_first_root<n>, exact_any_root<n>,    exact_all_roots<n>,  exact_first_roots<n>,
                exact_any_roots<n>,  exact_count_roots<n>, exact_visit_roots<n>};
    case Method::reference:
        return {reference_first_root<n>,
                any_root_of<reference_first_root<n>>,
                reference_all_roots<n>,
                first_roots_of<n, reference_first_root<n>>,
                any_roots_of<n, reference_first_root<n>>,
                count_roots_of<n, reference_all_roots<n>>,
                visit_roots_of<n, reference_all_roots<n>>};
    default:
        return {bracket_first_root<n>,
                any_root_of<bracket_first_root<n>>,
                bracket_all_roots<n>,
                first_roots_of<n, bracket_first_root<n>>,
                any_roots_of<n, bracket_first_root<n>>,
                count_roots_of<n, bracket_all_roots<n>>,
                visit_roots_of<n, bracket_all_roots<n>>};
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
