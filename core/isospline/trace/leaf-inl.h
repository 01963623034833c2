// Rays against the cells of a leaf and their slabs. Included once for each target.
#if defined(ISOSPLINE_TRACE_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_LEAF_INL_H
#undef ISOSPLINE_TRACE_LEAF_INL_H
#else
#define ISOSPLINE_TRACE_LEAF_INL_H
#endif

#include "isospline/trace/brick_cubes-inl.h"
#include "isospline/trace/brick_trace.h"
#include "isospline/trace/packet_candidates-inl.h"

#include <hwy/cache_control.h>

#include <array>
#include <cstddef>

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

// Begins to load what the tests of a leaf lead to: its coefficients, and the next leaf, which is often the ray's next.
HWY_INLINE void prefetch_around(const Leaves& leaves, const Leaf& leaf)
{
    constexpr int rows = 4; // of coefficients along an axis: two cells of degree 2
    for (int k = 0; k < rows; ++k)
        for (int j = 0; j < rows; ++j)
            hwy::Prefetch(leaf.coefficients + j * leaves.row_stride() + k * leaves.slice_stride());
    hwy::Prefetch(&leaf + 1);
}

HWY_INLINE CellCoefficients cell_of_leaf(const Leaves& leaves, const Leaf& leaf, const glm::ivec3& offset)
{
    const CoefficientView first{leaf.coefficients, leaves.row_stride(), leaves.slice_stride()};
    return {first.from(offset.x, offset.y, offset.z), leaves.threshold(), leaf.first_cell() + offset};
}

// The bits of the axes along which a direction is negative.
template <class Vector>
HWY_INLINE unsigned negative_axes(const Vector& direction)
{
    return (direction[0] < 0.0 ? 1u : 0u) | (direction[1] < 0.0 ? 2u : 0u) | (direction[2] < 0.0 ? 4u : 0u);
}

// One number for each cell of a block, from `first` on.
HWY_INLINE hn::Vec<Children> load_bytes(const std::array<std::int8_t, Block::capacity>& of_cells, std::size_t first)
{
    const Children d;
    const hn::RebindToSigned<Children> to_int;
    const hn::Rebind<std::int8_t, Children> to_byte;
    return hn::ConvertTo(d, hn::PromoteTo(to_int, hn::LoadU(to_byte, of_cells.data() + first)));
}

// Not above a ray's begin, because a hit may be there.
HWY_INLINE float begin_single(double t_near)
{
    const auto begin = static_cast<float>(t_near);
    return begin - 0x1p-23f * (begin < 0.0f ? -begin : begin);
}

// The cells of a leaf in whose slabs one ray is, for a part of its segment in them; SIMD lanes are the cells. `Ray` has
// `origin`, `direction_single` and `inverse_direction_single` of a LatticeRay. Sets where the ray enters the cells.
template <class Ray>
HWY_INLINE unsigned cells_met(const Leaf& leaf, const Ray& ray, float t_begin, float t_end, float margin,
                              float (&enters)[Block::capacity])
{
    const Children d;
    using V = hn::Vec<Children>;
    unsigned met = 0;
    for (std::size_t first = 0; first < Block::capacity; first += hn::Lanes(d)) {
        V t_near = hn::Set(d, t_begin), t_far = hn::Set(d, t_end);
        V along_direction = hn::Zero(d), to_cell = hn::Zero(d);
        for (int axis = 0; axis < 3; ++axis) {
            const float to_corner = static_cast<float>(leaf.first[static_cast<std::size_t>(axis)] - ray.origin[axis]);
            const V to_lower = hn::Add(hn::Load(d, half_of_child[0][axis] + first), hn::Set(d, to_corner));
            const V inverse = hn::Set(d, ray.inverse_direction_single[axis]);
            const V middle = hn::Mul(hn::Add(to_lower, hn::Set(d, 0.5f)), inverse);
            const V half = hn::Mul(hn::Set(d, 0.5f + margin), hn::Abs(inverse));
            t_near = hn::Max(t_near, hn::Sub(middle, half));
            t_far = hn::Min(t_far, hn::Add(middle, half));
            const V normal = load_bytes(leaf.block.slab_normal[axis], first);
            along_direction = hn::MulAdd(normal, hn::Set(d, ray.direction_single[axis]), along_direction);
            to_cell = hn::MulAdd(normal, to_lower, to_cell);
        }
        const V at_entry = hn::MulSub(along_direction, t_near, to_cell);
        const V at_exit = hn::MulSub(along_direction, t_far, to_cell);
        const V slab_margin = hn::Set(d, slab_margin_of(margin));
        const auto below_upper =
            hn::Le(hn::Min(at_entry, at_exit), hn::Add(load_bytes(leaf.block.slab_upper, first), slab_margin));
        const auto above_lower =
            hn::Ge(hn::Max(at_entry, at_exit), hn::Sub(load_bytes(leaf.block.slab_lower, first), slab_margin));
        hn::Store(t_near, d, enters + first);
        met |= to_lane_mask(d, hn::And(hn::Le(t_near, t_far), hn::And(below_upper, above_lower)), first);
    }
    return met & leaf.block.cells;
}

// One ray.
inline void trace_leaf(const Leaves& leaves, const Leaf& leaf, const LatticeRay& ray, float margin, double t_limit,
                       const RayVisitor& visitor)
{
    prefetch_around(leaves, leaf);
    auto t_end = static_cast<float>(t_limit);
    alignas(32) float enters[Block::capacity];
    const unsigned met = cells_met(leaf, ray, begin_single(ray.t_near), t_end, margin, enters);
    const unsigned flip = negative_axes(ray.direction);
    for (unsigned rest = front_to_back(met, flip); rest != 0; rest &= rest - 1u) {
        const unsigned child = static_cast<unsigned>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest)) ^ flip;
        if (enters[child] > t_end)
            continue;
        const CellCoefficients cell = cell_of_leaf(leaves, leaf, child_position(static_cast<int>(child)));
        t_end = static_cast<float>(visitor.visit(visitor.context, cell, glm::ivec3(cell.lower)));
    }
}

// A packet; SIMD lanes are the rays.
class PacketInLeaf {
    static constexpr int capacity = LatticeRayPacket::capacity;
    using Rays = hn::CappedTag<float, capacity>;
    using R = hn::Vec<Rays>;

public:
    // The rays from `first` on.
    HWY_INLINE PacketInLeaf(const Leaf& leaf, const LatticeRayPacket& rays, float margin, std::size_t first)
        : rays_(rays), first_(first)
    {
        const Rays d;
        const R half_edge = hn::Set(d, 0.5f + margin);
        for (int axis = 0; axis < 3; ++axis) {
            const R to_corner = less_origin(leaf.first[static_cast<std::size_t>(axis)], axis);
            const R inverse = hn::Load(d, rays.inverse_direction_single[axis] + first);
            const R half = hn::Mul(half_edge, hn::Abs(inverse));
            hn::Store(to_corner, d, to_corner_[axis]);
            for (int upper = 0; upper < 2; ++upper) {
                const R middle = hn::Mul(hn::Add(to_corner, hn::Set(d, static_cast<float>(upper) + 0.5f)), inverse);
                hn::Store(hn::Sub(middle, half), d, enters_[axis][upper]);
                hn::Store(hn::Add(middle, half), d, leaves_[axis][upper]);
            }
        }
        hn::Store(to_single(rays.t_near), d, t_near_);
        set_slabs(leaf.block, slab_margin_of(margin));
    }

    HWY_INLINE void set_limits(const double* t_limit)
    {
        const Rays d;
        hn::Store(hn::Min(to_single(rays_.t_far), to_single(t_limit)), d, t_limit_);
    }

    // The rays that meet a cell and are in its slab for a part of their segment in it.
    HWY_INLINE LaneMask lanes_of_cell(unsigned cell) const
    {
        const Rays d;
        const unsigned half[3] = {cell & 1u, cell >> 1 & 1u, cell >> 2};
        R t_near = hn::Load(d, t_near_), t_far = hn::Load(d, t_limit_);
        R along_direction = hn::Zero(d), to_corner = hn::Zero(d);
        for (int axis = 0; axis < 3; ++axis) {
            t_near = hn::Max(t_near, hn::Load(d, enters_[axis][half[axis]]));
            t_far = hn::Min(t_far, hn::Load(d, leaves_[axis][half[axis]]));
            const R normal = hn::Set(d, slab_normal_[axis][cell]);
            along_direction = hn::MulAdd(normal, hn::Load(d, rays_.direction_single[axis] + first_), along_direction);
            to_corner = hn::MulAdd(normal, hn::Load(d, to_corner_[axis]), to_corner);
        }
        const R at_entry = hn::MulSub(along_direction, t_near, to_corner);
        const R at_exit = hn::MulSub(along_direction, t_far, to_corner);
        const auto in_slab = hn::And(hn::Le(hn::Min(at_entry, at_exit), hn::Set(d, slab_upper_[cell])),
                                     hn::Ge(hn::Max(at_entry, at_exit), hn::Set(d, slab_lower_[cell])));
        return to_lane_mask(d, hn::And(hn::Le(t_near, t_far), in_slab), first_);
    }

private:
    using Halves = hn::CappedTag<double, (hn::MaxLanes(Rays()) + 1) / 2>;

    HWY_INLINE R to_single(const double* values) const
    {
        return in_halves([&](std::size_t lane) HWY_ATTR { return hn::Load(Halves(), values + first_ + lane); });
    }

    // A plane of the lattice as seen from the rays' origins.
    HWY_INLINE R less_origin(int plane, int axis) const
    {
        const auto at = hn::Set(Halves(), static_cast<double>(plane));
        return in_halves([&](std::size_t lane)
                             HWY_ATTR { return hn::Sub(at, hn::Load(Halves(), rays_.origin[axis] + first_ + lane)); });
    }

    // Rounds two vectors of double precision, those of lanes 0 on and of the upper half, into one of single precision.
    template <class Half>
    static HWY_INLINE R in_halves(const Half& half)
    {
        const Rays d;
        const hn::Rebind<float, Halves> single;
#if HWY_TARGET == HWY_SCALAR
        static_cast<void>(single);
        return hn::DemoteTo(d, half(0));
#else
        return hn::Combine(d, hn::DemoteTo(single, half(hn::Lanes(d) / 2)), hn::DemoteTo(single, half(0)));
#endif
    }

    // The slabs of all cells, with <normal, x> counted from the leaf's corner.
    HWY_INLINE void set_slabs(const Block& block, float slab_margin)
    {
        const Children d;
        for (std::size_t first = 0; first < Block::capacity; first += hn::Lanes(d)) {
            auto to_cell = hn::Zero(d);
            for (int axis = 0; axis < 3; ++axis) {
                const auto normal = load_bytes(block.slab_normal[axis], first);
                to_cell = hn::MulAdd(normal, hn::Load(d, half_of_child[0][axis] + first), to_cell);
                hn::Store(normal, d, slab_normal_[axis] + first);
            }
            const auto widened = hn::Set(d, slab_margin);
            hn::Store(hn::Add(hn::Add(load_bytes(block.slab_upper, first), to_cell), widened), d, slab_upper_ + first);
            hn::Store(hn::Sub(hn::Add(load_bytes(block.slab_lower, first), to_cell), widened), d, slab_lower_ + first);
        }
    }

    static constexpr std::size_t lanes = hn::MaxLanes(Rays());

    const LatticeRayPacket& rays_;
    std::size_t first_;
    alignas(64) float to_corner_[3][lanes]; // from the rays' origins to the leaf's first cell
    // Where the rays enter and leave the lower and the upper cells along each axis.
    alignas(64) float enters_[3][2][lanes], leaves_[3][2][lanes];
    alignas(64) float t_near_[lanes], t_limit_[lanes];
    alignas(32) float slab_normal_[3][Block::capacity], slab_lower_[Block::capacity], slab_upper_[Block::capacity];
};

inline void trace_packet_in_leaf(const Leaves& leaves, const Leaf& leaf, const LatticeRayPacket& rays, float margin,
                                 LaneMask active, const PacketVisitor& visitor)
{
    prefetch_around(leaves, leaf);
    const hn::CappedTag<float, LatticeRayPacket::capacity> d;
    const int any_lane = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(active));
    const unsigned flip = negative_axes(rays.direction_of(any_lane));
    const CoefficientView coefficients{leaf.coefficients, leaves.row_stride(), leaves.slice_stride()};
    PacketCandidates candidates(leaves.degree(), visitor);
    for (std::size_t first = 0; first < LatticeRayPacket::capacity; first += hn::Lanes(d)) {
        const LaneMask wanted = active & all_lanes(d) << first;
        if (wanted == 0)
            continue;
        PacketInLeaf packet(leaf, rays, margin, first);
        packet.set_limits(visitor.t_limit);
        for (unsigned rest = front_to_back(leaf.block.cells, flip); rest != 0; rest &= rest - 1u) {
            const unsigned child = static_cast<unsigned>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest)) ^ flip;
            const LaneMask lanes = packet.lanes_of_cell(child) & wanted;
            if (lanes == 0)
                continue;
            const glm::ivec3 offset = child_position(static_cast<int>(child));
            if (candidates.add(coefficients.from(offset.x, offset.y, offset.z), leaf.first_cell() + offset, lanes))
                packet.set_limits(visitor.t_limit);
        }
    }
    candidates.finish();
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
