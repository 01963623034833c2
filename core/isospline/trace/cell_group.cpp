#include "isospline/trace/cell_group.h"

#include "isospline/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <numeric>

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

// Whether [t_near, t_far] is not empty and a part of it in the slab lower <= <normal, x> <= upper, given the products
// of the normal with the ray's direction and with the way from its origin to where x is 0.
template <class V>
HWY_INLINE auto MeetsOrientedSlab(V lower, V upper, V along_direction, V to_corner, V t_near, V t_far)
{
    const V at_entry = hn::MulSub(along_direction, t_near, to_corner);
    const V at_exit = hn::MulSub(along_direction, t_far, to_corner);
    const auto in_slab = hn::And(hn::Le(hn::Min(at_entry, at_exit), upper), hn::Ge(hn::Max(at_entry, at_exit), lower));
    return hn::And(hn::Le(t_near, t_far), in_slab);
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
        // Not above the limit itself, which a hit may be at.
        const float begin = static_cast<float>(ray.t_near);
        V t_near = hn::Set(d, begin - 0x1p-23f * std::abs(begin)), t_far = hn::Set(d, static_cast<float>(ray.t_far));
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
        const auto meets =
            MeetsOrientedSlab(hn::Sub(load(group.slab_lower), slab_margin),
                              hn::Add(load(group.slab_upper), slab_margin), along_direction, to_corner, t_near, t_far);
        hn::Store(t_near, d, entries.t_near + first);
        entries.cells |= ToLaneMask(d, meets, first);
    }
    entries.cells &= group.members;
    return entries;
}

// Lanes are the rays.
std::array<LaneMask, CellGroup::capacity> Lanes(const CellGroup& group, const LatticeRayPacket& rays,
                                                const double* t_limit, LaneMask active, float margin)
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
        const auto end = hn::Min(hn::Load(doubles, rays.t_far + first), hn::LoadU(doubles, t_limit + first));
        hn::Store(hn::DemoteTo(to_float, end), to_float, t_far + first);
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
            const V slab_lower = hn::Set(d, static_cast<float>(group.slab_lower[cell]) - SlabMargin(margin));
            const V slab_upper = hn::Set(d, static_cast<float>(group.slab_upper[cell]) + SlabMargin(margin));
            const auto meets = MeetsOrientedSlab(slab_lower, slab_upper, along_direction, to_cell, near_t, far_t);
            lanes[cell] |= ToLaneMask(d, meets, first);
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

/// Whether two cells are in one group.
bool are_together(const Cell& a, const Cell& b)
{
    return a.x / 2 == b.x / 2 && a.y / 2 == b.y / 2 && a.z / 2 == b.z / 2;
}

} // namespace

std::vector<CellGroup> cell_groups(const IsosurfaceSnapshot& surface)
{
    // Cells of a group follow each other: a group belongs to the chunk of rows in which it begins.
    const std::vector<Cell>& cells = surface.shell().cells();
    constexpr std::size_t chunk_size = 4096;
    const std::size_t chunk_count = (cells.size() + chunk_size - 1) / chunk_size;
    const auto for_each_first_row = [&](std::size_t chunk, const auto& body) {
        const std::size_t end = std::min((chunk + 1) * chunk_size, cells.size());
        for (std::size_t row = chunk * chunk_size; row < end; ++row)
            if (row == 0 || !are_together(cells[row - 1], cells[row]))
                body(row);
    };
    std::vector<std::size_t> first_of_chunk(chunk_count + 1, 0);
    parallel_for(chunk_count, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t chunk = begin; chunk < end; ++chunk)
            for_each_first_row(chunk, [&](std::size_t) { ++first_of_chunk[chunk + 1]; });
    });
    std::partial_sum(first_of_chunk.begin(), first_of_chunk.end(), first_of_chunk.begin());

    std::vector<CellGroup> groups(first_of_chunk.back());
    parallel_for(chunk_count, 1, [&](std::size_t begin, std::size_t end) {
        CellGroup* group = groups.data() + first_of_chunk[begin];
        for (std::size_t chunk = begin; chunk < end; ++chunk)
            for_each_first_row(chunk, [&](std::size_t row) {
                const auto even = [](std::uint16_t index) { return static_cast<std::uint16_t>(index & ~1u); };
                const Cell corner{even(cells[row].x), even(cells[row].y), even(cells[row].z)};
                group->corner = {corner.x, corner.y, corner.z};
                group->first_row = static_cast<std::uint32_t>(row);
                for (; row < cells.size() && are_together(corner, cells[row]); ++row)
                    group->members |= static_cast<std::uint8_t>(
                        1u << ((cells[row].x & 1u) | (cells[row].y & 1u) << 1 | (cells[row].z & 1u) << 2));
                set_slabs(*group, CellBlock(surface.volume(), surface.threshold(), corner), surface.volume().degree());
                ++group;
            });
    });
    return groups;
}

GroupCuller group_culler()
{
    return HWY_DYNAMIC_DISPATCH(Culler)();
}

} // namespace isospline
#endif
