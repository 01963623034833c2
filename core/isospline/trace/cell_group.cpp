#include "isospline/trace/cell_group.h"

#include "isospline/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/cell_group.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/trace/group_table-inl.h"
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

// Lanes are the cells of a group, as many as there is room for.
using Cells = hn::CappedTag<float, CellGroup::capacity>;

// B-spline coefficients along a line to the Bernstein coefficients of the same polynomial in the cell.
template <int Degree, class D, class Item>
HWY_INLINE void LineToBernstein(D d, const Item& c)
{
    using V = hn::Vec<D>;
    const V half = hn::Set(d, 0.5f);
    if constexpr (Degree == 2) {
        c(0) = hn::Mul(half, hn::Add(c(0), c(1)));
        c(2) = hn::Mul(half, hn::Add(c(1), c(2)));
    } else if constexpr (Degree == 3) {
        // Knots are inserted where the cell begins and ends.
        const auto third = [&](V near, V far) HWY_ATTR {
            return hn::Mul(hn::Set(d, 1.0f / 3.0f), hn::MulAdd(hn::Set(d, 2.0f), near, far));
        };
        const V before = third(c(1), c(0)), after = third(c(2), c(3));
        const V left = third(c(1), c(2)), right = third(c(2), c(1));
        c(0) = hn::Mul(half, hn::Add(before, left));
        c(1) = left;
        c(2) = right;
        c(3) = hn::Mul(half, hn::Add(right, after));
    }
}

// The same along all axes of a cell, x being the last.
template <int Degree, class D, class V>
HWY_INLINE void CellToBernstein(D d, V (&c)[Degree + 1][Degree + 1][Degree + 1])
{
    const auto for_each_line = [](const auto& convert) HWY_ATTR {
        for (int p = 0; p <= Degree; ++p)
            for (int q = 0; q <= Degree; ++q)
                convert(p, q);
    };
    for_each_line([&](int p, int q) HWY_ATTR { LineToBernstein<Degree>(d, [&](int i) -> V& { return c[p][q][i]; }); });
    for_each_line([&](int p, int q) HWY_ATTR { LineToBernstein<Degree>(d, [&](int i) -> V& { return c[p][i][q]; }); });
    for_each_line([&](int p, int q) HWY_ATTR { LineToBernstein<Degree>(d, [&](int i) -> V& { return c[i][p][q]; }); });
}

// Sets slabs along the mean gradients of the cells.
//
// In Bernstein form, a linear l has its values at the Greville abscissae as coefficients, 1/n apart. So f - l has the
// differences as coefficients, and lies between the least and the largest of them, as the weights are not negative and
// sum to one. Where f is the level, l is between the negatives of these.
template <int Degree>
void SetSlabs(CellGroup& group, const CellBlock& corner)
{
    // Positions of coefficients from the middle of the cell.
    constexpr int count = Degree + 1;
    constexpr auto position = [](int i) { return static_cast<float>(i) / Degree - 0.5f; };
    float squares_of_positions = 0.0f;
    for (int i = 0; i < count; ++i)
        squares_of_positions += position(i) * position(i) * static_cast<float>(count * count);

    const Cells d;
    const hn::RebindToSigned<Cells> to_int;
    const hn::Rebind<std::int8_t, Cells> to_byte;
    using V = hn::Vec<Cells>;
    const GroupTable<Degree> table(corner, group.members);
    const auto single_threshold = static_cast<float>(corner.threshold);
    const V threshold = hn::Set(d, single_threshold), zero = hn::Zero(d);
    for (std::size_t first = 0; first < CellGroup::capacity; first += hn::Lanes(d)) {
        // The slope of the least-squares fit along each axis, but for a factor.
        const CoefficientsOfLanes<Degree, Cells> look_up(d, table, hn::Iota(to_int, static_cast<std::int32_t>(first)));
        V coefficients[count][count][count];
        V magnitude = zero, sums[3] = {zero, zero, zero};
        for (int k = 0; k < count; ++k)
            for (int j = 0; j < count; ++j)
                for (int i = 0; i < count; ++i) {
                    const V coefficient = hn::Sub(look_up(i, j, k), threshold);
                    coefficients[k][j][i] = coefficient;
                    magnitude = hn::Max(magnitude, hn::Abs(coefficient));
                }
        CellToBernstein<Degree>(d, coefficients);
        for (int k = 0; k < count; ++k)
            for (int j = 0; j < count; ++j) {
                V sum = zero;
                for (int i = 0; i < count; ++i) {
                    const V coefficient = coefficients[k][j][i];
                    sum = hn::Add(sum, coefficient);
                    sums[0] = hn::MulAdd(hn::Set(d, position(i)), coefficient, sums[0]);
                }
                sums[1] = hn::MulAdd(hn::Set(d, position(j)), sum, sums[1]);
                sums[2] = hn::MulAdd(hn::Set(d, position(k)), sum, sums[2]);
            }
        const V largest = hn::Max(hn::Abs(sums[0]), hn::Max(hn::Abs(sums[1]), hn::Abs(sums[2])));
        const auto has_slope = hn::And(hn::Gt(largest, zero), hn::Le(largest, hn::Set(d, 1e37f)));

        // The linear function along the rounded normal.
        V normal[3], dot = zero, square = zero;
        const V longest = hn::Div(hn::Set(d, 31.0f), hn::IfThenElse(has_slope, largest, hn::Set(d, 1.0f)));
        for (int axis = 0; axis < 3; ++axis) {
            normal[axis] = hn::IfThenElseZero(has_slope, hn::Round(hn::Mul(sums[axis], longest)));
            dot = hn::MulAdd(normal[axis], sums[axis], dot);
            square = hn::MulAdd(normal[axis], normal[axis], square);
        }
        const V scale = hn::Div(dot, hn::Mul(square, hn::Set(d, squares_of_positions)));
        V least = hn::Set(d, std::numeric_limits<float>::infinity()), most = hn::Neg(least);
        for (int k = 0; k < count; ++k)
            for (int j = 0; j < count; ++j) {
                const V across = hn::Mul(
                    scale, hn::MulAdd(normal[1], hn::Set(d, position(j)), hn::Mul(normal[2], hn::Set(d, position(k)))));
                const V along = hn::Mul(scale, normal[0]);
                for (int i = 0; i < count; ++i) {
                    const V linear = hn::MulAdd(along, hn::Set(d, position(i)), across);
                    const V difference = hn::Sub(coefficients[k][j][i], linear);
                    least = hn::Min(least, difference);
                    most = hn::Max(most, difference);
                }
            }

        // A Bernstein coefficient is off by at most 4 roundings an axis, of numbers of at most 3 times the magnitude, a
        // difference by 16 more, of at most 5 times the magnitude, and both by the threshold's own.
        const V rounding = hn::Mul(hn::Set(d, 0x1p-24f), hn::MulAdd(hn::Set(d, 116.0f), magnitude,
                                                                    hn::Set(d, 2.0f * std::abs(single_threshold))));
        const V middle = hn::Mul(hn::Set(d, 0.5f), hn::Add(normal[0], hn::Add(normal[1], normal[2])));
        const V of_the_quotient = hn::Set(d, 1e-4f), least_byte = hn::Set(d, -128.0f), most_byte = hn::Set(d, 127.0f);
        const V lower = hn::Sub(middle, hn::Div(hn::Add(most, rounding), scale));
        const V upper = hn::Sub(middle, hn::Div(hn::Sub(least, rounding), scale));
        const auto store = [&](V value, auto& bytes) HWY_ATTR {
            const V limited = hn::Max(least_byte, hn::Min(most_byte, value));
            hn::StoreU(hn::DemoteTo(to_byte, hn::ConvertTo(to_int, limited)), to_byte, bytes.data() + first);
        };
        for (int axis = 0; axis < 3; ++axis)
            store(normal[axis], group.slab_normal[axis]);
        store(hn::IfThenElse(has_slope, hn::Floor(hn::Sub(lower, of_the_quotient)), least_byte), group.slab_lower);
        store(hn::IfThenElse(has_slope, hn::Ceil(hn::Add(upper, of_the_quotient)), most_byte), group.slab_upper);
    }
}

// bounds() relative to the group's corner.
void BoundsFromCorner(const CellGroup& group, float (&lower)[3], float (&upper)[3])
{
    const Cells d;
    const hn::RebindToSigned<Cells> to_int;
    const hn::Rebind<std::int8_t, Cells> to_byte;
    using V = hn::Vec<Cells>;
    const V zero = hn::Zero(d), one = hn::Set(d, 1.0f), infinity = hn::Set(d, std::numeric_limits<float>::infinity());
    for (int axis = 0; axis < 3; ++axis) {
        lower[axis] = std::numeric_limits<float>::infinity();
        upper[axis] = -lower[axis];
    }
    for (std::size_t first = 0; first < CellGroup::capacity; first += hn::Lanes(d)) {
        const auto load = [&](const auto& bytes) HWY_ATTR {
            return hn::ConvertTo(d, hn::PromoteTo(to_int, hn::LoadU(to_byte, bytes.data() + first)));
        };
        const V slab_lower = load(group.slab_lower), slab_upper = load(group.slab_upper);
        V normal[3], least = zero, most = zero; // of <normal, local> in the cell
        for (int axis = 0; axis < 3; ++axis) {
            normal[axis] = load(group.slab_normal[axis]);
            least = hn::Add(least, hn::Min(normal[axis], zero));
            most = hn::Add(most, hn::Max(normal[axis], zero));
        }
        V box_lower[3], box_upper[3];
        auto used = ToMask(d, group.members, first);
        for (int axis = 0; axis < 3; ++axis) {
            // What is left for this axis when the others are at their ends.
            const auto across = hn::Eq(normal[axis], zero);
            const V inverse = hn::Div(one, hn::IfThenElse(across, one, normal[axis]));
            const V from_lower = hn::Mul(hn::Sub(slab_lower, hn::Sub(most, hn::Max(normal[axis], zero))), inverse);
            const V from_upper = hn::Mul(hn::Sub(slab_upper, hn::Sub(least, hn::Min(normal[axis], zero))), inverse);
            box_lower[axis] = hn::IfThenElseZero(hn::Not(across), hn::Max(zero, hn::Min(from_lower, from_upper)));
            box_upper[axis] = hn::IfThenElse(across, one, hn::Min(one, hn::Max(from_lower, from_upper)));
            used = hn::And(used, hn::Le(box_lower[axis], box_upper[axis]));
        }
        const auto cell = hn::Iota(to_int, static_cast<std::int32_t>(first));
        const auto extend = [&](int axis, auto bit) HWY_ATTR {
            const V offset = hn::ConvertTo(d, hn::And(bit, hn::Set(to_int, 1)));
            const V from = hn::IfThenElse(used, hn::Add(offset, box_lower[axis]), infinity);
            const V to = hn::IfThenElse(used, hn::Add(offset, box_upper[axis]), hn::Neg(infinity));
            lower[axis] = std::min(lower[axis], hn::GetLane(hn::MinOfLanes(d, from)));
            upper[axis] = std::max(upper[axis], hn::GetLane(hn::MaxOfLanes(d, to)));
        };
        extend(0, cell);
        extend(1, hn::ShiftRight<1>(cell));
        extend(2, hn::ShiftRight<2>(cell));
    }
}

void SetSlabsOfDegree(CellGroup& group, const CellBlock& corner, int degree)
{
    switch (degree) {
    case 1:
        return SetSlabs<1>(group, corner);
    case 2:
        return SetSlabs<2>(group, corner);
    default:
        return SetSlabs<3>(group, corner);
    }
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
HWY_EXPORT(SetSlabsOfDegree);
HWY_EXPORT(BoundsFromCorner);

namespace {

/// Whether two cells are in one group.
bool are_together(const Cell& a, const Cell& b)
{
    return a.x / 2 == b.x / 2 && a.y / 2 == b.y / 2 && a.z / 2 == b.z / 2;
}

} // namespace

std::vector<CellGroup> cell_groups(const Isosurface& surface)
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

void set_slabs(CellGroup& group, const CellBlock& corner, int degree)
{
    HWY_DYNAMIC_DISPATCH(SetSlabsOfDegree)(group, corner, degree);
}

Box bounds(const CellGroup& group)
{
    float lower[3], upper[3];
    HWY_DYNAMIC_DISPATCH(BoundsFromCorner)(group, lower, upper);
    const glm::dvec3 corner(group.corner[0], group.corner[1], group.corner[2]);
    return {corner + glm::dvec3(lower[0], lower[1], lower[2]), corner + glm::dvec3(upper[0], upper[1], upper[2])};
}

GroupCuller group_culler()
{
    return HWY_DYNAMIC_DISPATCH(Culler)();
}

} // namespace isospline
#endif
