#include "isospline/trace/cell_group.h"

#include "isospline/trace/surface_slab.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <cmath>

#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/cell_group.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/trace/lane_mask-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Narrows [t_near, t_far] to a slab of boxes, whose sides are relative to the ray's origin.
template <class V>
HWY_INLINE void ClipToSlab(V lower, V upper, V inverse_direction, V& t_near, V& t_far)
{
    const V to_lower = hn::Mul(lower, inverse_direction), to_upper = hn::Mul(upper, inverse_direction);
    t_near = hn::Max(t_near, hn::Min(to_lower, to_upper));
    t_far = hn::Min(t_far, hn::Max(to_lower, to_upper));
}

// Narrows it to the slab lower <= <normal, x> <= upper, given the products of the normal with the ray's direction and
// with the way from its origin to where x is 0.
template <class D, class V>
HWY_INLINE void ClipToOrientedSlab(D d, V lower, V upper, V along_direction, V to_corner, V& t_near, V& t_far)
{
    const V tiny = hn::Set(d, 1e-30f);
    const auto parallel = hn::Lt(hn::Abs(along_direction), tiny);
    const V inverse = hn::Div(hn::Set(d, 1.0f), hn::IfThenElse(parallel, tiny, along_direction));
    ClipToSlab(hn::Add(lower, to_corner), hn::Add(upper, to_corner), inverse, t_near, t_far);
}

// A margin in units of <normal, x>, given that along an axis: normals have three components of at most 31.
HWY_INLINE float SlabMargin(float margin)
{
    return 96.0f * margin;
}

// Lanes are the cells.
GroupEntries Entries(const CellGroup& group, const LatticeRay& ray, float margin)
{
    const hn::CappedTag<float, CellGroup::capacity> d;
    const hn::RebindToSigned<decltype(d)> to_int;
    const hn::Rebind<std::int8_t, decltype(d)> to_byte;
    using V = hn::Vec<decltype(d)>;
    alignas(32) constexpr float offsets[3][CellGroup::capacity] = {
        {0, 1, 0, 1, 0, 1, 0, 1}, {0, 0, 1, 1, 0, 0, 1, 1}, {0, 0, 0, 0, 1, 1, 1, 1}};
    GroupEntries entries;
    entries.cells = 0;
    for (std::size_t first = 0; first < CellGroup::capacity; first += hn::Lanes(d)) {
        const auto load = [&](const auto& bytes) HWY_ATTR {
            return hn::ConvertTo(d, hn::PromoteTo(to_int, hn::LoadU(to_byte, bytes.data() + first)));
        };
        V t_near = hn::Set(d, static_cast<float>(ray.t_near)), t_far = hn::Set(d, static_cast<float>(ray.t_far));
        V along_direction = hn::Zero(d), to_corner = hn::Zero(d);
        for (int axis = 0; axis < 3; ++axis) {
            const auto corner = static_cast<float>(group.corner[static_cast<std::size_t>(axis)] - ray.origin[axis]);
            const V to_lower = hn::Add(hn::Load(d, offsets[axis] + first), hn::Set(d, corner));
            ClipToSlab(hn::Sub(to_lower, hn::Set(d, margin)), hn::Add(to_lower, hn::Set(d, 1.0f + margin)),
                       hn::Set(d, ray.inverse_direction_single[axis]), t_near, t_far);
            const V normal = load(group.slab_normal[axis]);
            along_direction = hn::MulAdd(normal, hn::Set(d, ray.direction_single[axis]), along_direction);
            to_corner = hn::MulAdd(normal, to_lower, to_corner);
        }
        const V slab_margin = hn::Set(d, SlabMargin(margin));
        ClipToOrientedSlab(d, hn::Sub(load(group.slab_lower), slab_margin),
                           hn::Add(load(group.slab_upper), slab_margin), along_direction, to_corner, t_near, t_far);
        hn::Store(t_near, d, entries.t_near + first);
        entries.cells |= ToLaneMask(d, hn::Le(t_near, t_far), first);
    }
    entries.cells &= group.members;
    return entries;
}

// Lanes are the rays.
std::array<LaneMask, CellGroup::capacity> Lanes(const CellGroup& group, const LatticeRayPacket& rays, LaneMask active,
                                                float margin)
{
    const hn::CappedTag<double, LatticeRayPacket::capacity> doubles;
    const hn::Rebind<float, decltype(doubles)> to_float;
    alignas(64) float corner[3][LatticeRayPacket::capacity];
    alignas(64) float t_near[LatticeRayPacket::capacity], t_far[LatticeRayPacket::capacity];
    for (std::size_t first = 0; first < LatticeRayPacket::capacity; first += hn::Lanes(doubles)) {
        for (int axis = 0; axis < 3; ++axis) {
            const auto at = hn::Set(doubles, group.corner[static_cast<std::size_t>(axis)]);
            hn::Store(hn::DemoteTo(to_float, hn::Sub(at, hn::Load(doubles, rays.origin[axis] + first))), to_float,
                      corner[axis] + first);
        }
        hn::Store(hn::DemoteTo(to_float, hn::Load(doubles, rays.t_near + first)), to_float, t_near + first);
        hn::Store(hn::DemoteTo(to_float, hn::Load(doubles, rays.t_far + first)), to_float, t_far + first);
    }

    std::array<LaneMask, CellGroup::capacity> lanes{};
    const hn::CappedTag<float, LatticeRayPacket::capacity> d;
    using V = hn::Vec<decltype(d)>;
    for (unsigned rest = group.members; rest != 0; rest &= rest - 1u) {
        const auto cell = static_cast<std::size_t>(std::countr_zero(rest));
        for (std::size_t first = 0; first < LatticeRayPacket::capacity; first += hn::Lanes(d)) {
            V near_t = hn::Load(d, t_near + first), far_t = hn::Load(d, t_far + first);
            V along_direction = hn::Zero(d), to_cell = hn::Zero(d);
            for (int axis = 0; axis < 3; ++axis) {
                const float offset = static_cast<float>(cell >> axis & 1);
                const V to_lower = hn::Add(hn::Load(d, corner[axis] + first), hn::Set(d, offset));
                ClipToSlab(hn::Sub(to_lower, hn::Set(d, margin)), hn::Add(to_lower, hn::Set(d, 1.0f + margin)),
                           hn::Load(d, rays.inverse_direction_single[axis] + first), near_t, far_t);
                const V normal = hn::Set(d, static_cast<float>(group.slab_normal[axis][cell]));
                along_direction = hn::MulAdd(normal, hn::Load(d, rays.direction_single[axis] + first), along_direction);
                to_cell = hn::MulAdd(normal, to_lower, to_cell);
            }
            ClipToOrientedSlab(d, hn::Set(d, static_cast<float>(group.slab_lower[cell]) - SlabMargin(margin)),
                               hn::Set(d, static_cast<float>(group.slab_upper[cell]) + SlabMargin(margin)),
                               along_direction, to_cell, near_t, far_t);
            lanes[cell] |= ToLaneMask(d, hn::Le(near_t, far_t), first);
        }
        lanes[cell] &= active;
    }
    return lanes;
}

GroupCuller Culler()
{
    return {Entries, Lanes};
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(Culler);

namespace {

template <int Degree>
void set_bounds(CellGroup& group, const Isosurface& surface)
{
    const std::vector<Cell>& cells = surface.shell().cells();
    std::uint32_t row = group.first_row;
    for (unsigned rest = group.members; rest != 0; rest &= rest - 1u) {
        const CellBlock cell(surface.volume(), surface.threshold(), cells[row++]);
        const auto at = static_cast<std::size_t>(std::countr_zero(rest));
        const SurfaceSlab slab = surface_slab<Degree>(cell);
        for (std::size_t axis = 0; axis < 3; ++axis)
            group.slab_normal[axis][at] = slab.normal[axis];
        group.slab_lower[at] = slab.lower;
        group.slab_upper[at] = slab.upper;
    }
}

} // namespace

std::vector<CellGroup> cell_groups(const Isosurface& surface)
{
    std::vector<CellGroup> groups;
    const std::vector<Cell>& cells = surface.shell().cells();
    for (std::size_t row = 0; row < cells.size(); ++row) {
        const std::array<std::uint16_t, 3> position{cells[row].x, cells[row].y, cells[row].z};
        std::array<std::uint16_t, 3> corner;
        unsigned cell = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            corner[axis] = static_cast<std::uint16_t>(position[axis] & ~1u);
            cell |= (position[axis] & 1u) << axis;
        }
        if (groups.empty() || groups.back().corner != corner)
            groups.push_back({corner, {}, {}, {}, static_cast<std::uint32_t>(row), 0});
        groups.back().members |= static_cast<std::uint8_t>(1u << cell);
    }

    groups.shrink_to_fit();
    const auto set = surface.volume().degree() == 1   ? set_bounds<1>
                     : surface.volume().degree() == 2 ? set_bounds<2>
                                                      : set_bounds<3>;
    parallel_for(groups.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            set(groups[i], surface);
    });
    return groups;
}

Box bounds(const CellGroup& group)
{
    Box box;
    for (unsigned rest = group.members; rest != 0; rest &= rest - 1u) {
        const int cell = std::countr_zero(rest);
        const auto at = static_cast<std::size_t>(cell);
        const SurfaceSlab slab{{group.slab_normal[0][at], group.slab_normal[1][at], group.slab_normal[2][at]},
                               group.slab_lower[at],
                               group.slab_upper[at]};
        const glm::dvec3 lower(group.corner[0] + (cell & 1), group.corner[1] + (cell >> 1 & 1),
                               group.corner[2] + (cell >> 2));
        const Box part = bounds(slab);
        if (part.empty())
            continue;
        box.extend(lower + part.lower);
        box.extend(lower + part.upper);
    }
    return box;
}

GroupCuller group_culler()
{
    return HWY_DYNAMIC_DISPATCH(Culler)();
}

} // namespace isospline
#endif
