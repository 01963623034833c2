// Rays against the cells of a leaf and their slabs. Included once for each target.
#if defined(ISOSPLINE_TRACE_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_LEAF_INL_H
#undef ISOSPLINE_TRACE_LEAF_INL_H
#else
#define ISOSPLINE_TRACE_LEAF_INL_H
#endif

#include "isospline/trace/brick_cubes-inl.h"
#include "isospline/trace/brick_trace.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

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

// One ray; SIMD lanes are the cells.
inline void trace_leaf(const Leaves& leaves, const Leaf& leaf, const LatticeRay& ray, float margin, double t_limit,
                       const RayVisitor& visitor)
{
    const Children d;
    const hn::RebindToSigned<Children> to_int;
    const hn::Rebind<std::int8_t, Children> to_byte;
    using V = hn::Vec<Children>;
    const auto begin = static_cast<float>(ray.t_near);
    const float t_begin = begin - 0x1p-23f * (begin < 0.0f ? -begin : begin); // a hit may be at the limit itself
    auto t_end = static_cast<float>(t_limit);
    alignas(32) float enters[8];
    unsigned met = 0;
    for (std::size_t first = 0; first < 8; first += hn::Lanes(d)) {
        const auto load = [&](const auto& bytes) HWY_ATTR {
            return hn::ConvertTo(d, hn::PromoteTo(to_int, hn::LoadU(to_byte, &bytes[0] + first)));
        };
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
            const V normal = load(leaf.block.slab_normal[axis]);
            along_direction = hn::MulAdd(normal, hn::Set(d, ray.direction_single[axis]), along_direction);
            to_cell = hn::MulAdd(normal, to_lower, to_cell);
        }
        const V at_entry = hn::MulSub(along_direction, t_near, to_cell);
        const V at_exit = hn::MulSub(along_direction, t_far, to_cell);
        const V slab_margin = hn::Set(d, slab_margin_of(margin));
        const auto below_upper = hn::Le(hn::Min(at_entry, at_exit), hn::Add(load(leaf.block.slab_upper), slab_margin));
        const auto above_lower = hn::Ge(hn::Max(at_entry, at_exit), hn::Sub(load(leaf.block.slab_lower), slab_margin));
        hn::Store(t_near, d, enters + first);
        met |= to_lane_mask(d, hn::And(hn::Le(t_near, t_far), hn::And(below_upper, above_lower)), first);
    }
    const unsigned flip = negative_axes(ray.direction);
    for (unsigned rest = front_to_back(met & leaf.block.cells, flip); rest != 0; rest &= rest - 1u) {
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
    HWY_INLINE PacketInLeaf(const Leaf& leaf, const LatticeRayPacket& rays, float margin)
        : leaf_(leaf), rays_(rays), slab_margin_(slab_margin_of(margin))
    {
        const Rays d;
        const hn::CappedTag<double, capacity> doubles;
        const hn::Rebind<float, decltype(doubles)> to_float;
        for (int axis = 0; axis < 3; ++axis) {
            const auto corner = hn::Set(doubles, static_cast<double>(leaf.first[static_cast<std::size_t>(axis)]));
            for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(doubles))
                hn::Store(hn::DemoteTo(to_float, hn::Sub(corner, hn::Load(doubles, rays.origin[axis] + lane))),
                          to_float, to_corner_[axis] + lane);
            for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(d)) {
                const R inverse = hn::Load(d, rays.inverse_direction_single[axis] + lane);
                const R to_corner = hn::Load(d, to_corner_[axis] + lane);
                const R half = hn::Mul(hn::Set(d, 0.5f + margin), hn::Abs(inverse));
                for (int upper = 0; upper < 2; ++upper) {
                    const R middle = hn::Mul(hn::Add(to_corner, hn::Set(d, static_cast<float>(upper) + 0.5f)), inverse);
                    hn::Store(hn::Sub(middle, half), d, enters_[axis][upper] + lane);
                    hn::Store(hn::Add(middle, half), d, leaves_[axis][upper] + lane);
                }
            }
        }
        for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(doubles))
            hn::Store(hn::DemoteTo(to_float, hn::Load(doubles, rays.t_near + lane)), to_float, t_near_ + lane);
    }

    HWY_INLINE void set_limits(const double* t_limit)
    {
        const hn::CappedTag<double, capacity> doubles;
        const hn::Rebind<float, decltype(doubles)> to_float;
        for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(doubles)) {
            const auto limit = hn::Min(hn::Load(doubles, rays_.t_far + lane), hn::LoadU(doubles, t_limit + lane));
            hn::Store(hn::DemoteTo(to_float, limit), to_float, t_limit_ + lane);
        }
    }

    // The rays that meet a cell and are in its slab for a part of their segment in it.
    HWY_INLINE LaneMask lanes_of_cell(unsigned cell) const
    {
        const Rays d;
        const unsigned half[3] = {cell & 1u, cell >> 1 & 1u, cell >> 2};
        float to_first = 0.0f; // <normal, x> at the cell's corner, counted from the leaf's
        for (int axis = 0; axis < 3; ++axis)
            to_first += half[axis] != 0 ? static_cast<float>(leaf_.block.slab_normal[axis][cell]) : 0.0f;
        const R upper = hn::Set(d, static_cast<float>(leaf_.block.slab_upper[cell]) + to_first + slab_margin_);
        const R lower = hn::Set(d, static_cast<float>(leaf_.block.slab_lower[cell]) + to_first - slab_margin_);
        LaneMask lanes = 0;
        for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(d)) {
            R t_near = hn::Load(d, t_near_ + lane), t_far = hn::Load(d, t_limit_ + lane);
            R along_direction = hn::Zero(d), to_corner = hn::Zero(d);
            for (int axis = 0; axis < 3; ++axis) {
                t_near = hn::Max(t_near, hn::Load(d, enters_[axis][half[axis]] + lane));
                t_far = hn::Min(t_far, hn::Load(d, leaves_[axis][half[axis]] + lane));
                const R normal = hn::Set(d, static_cast<float>(leaf_.block.slab_normal[axis][cell]));
                along_direction = hn::MulAdd(normal, hn::Load(d, rays_.direction_single[axis] + lane), along_direction);
                to_corner = hn::MulAdd(normal, hn::Load(d, to_corner_[axis] + lane), to_corner);
            }
            const R at_entry = hn::MulSub(along_direction, t_near, to_corner);
            const R at_exit = hn::MulSub(along_direction, t_far, to_corner);
            const auto in_slab =
                hn::And(hn::Le(hn::Min(at_entry, at_exit), upper), hn::Ge(hn::Max(at_entry, at_exit), lower));
            lanes |= to_lane_mask(d, hn::And(hn::Le(t_near, t_far), in_slab), lane);
        }
        return lanes;
    }

private:
    const Leaf& leaf_;
    const LatticeRayPacket& rays_;
    float slab_margin_;
    alignas(64) float to_corner_[3][capacity]; // from the rays' origins to the leaf's first cell
    // Where the rays enter and leave the lower and the upper cells along each axis.
    alignas(64) float enters_[3][2][capacity], leaves_[3][2][capacity];
    alignas(64) float t_near_[capacity], t_limit_[capacity];
};

inline void trace_packet_in_leaf(const Leaves& leaves, const Leaf& leaf, const LatticeRayPacket& rays, float margin,
                                 LaneMask active, const PacketVisitor& visitor)
{
    PacketInLeaf packet(leaf, rays, margin);
    packet.set_limits(visitor.t_limit);
    const int any_lane = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(active));
    const unsigned flip = negative_axes(rays.direction_of(any_lane));
    for (unsigned rest = front_to_back(leaf.block.cells, flip); rest != 0; rest &= rest - 1u) {
        const unsigned child = static_cast<unsigned>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest)) ^ flip;
        const LaneMask lanes = packet.lanes_of_cell(child) & active;
        if (lanes == 0)
            continue;
        const CellCoefficients cell = cell_of_leaf(leaves, leaf, child_position(static_cast<int>(child)));
        if (visitor.visit(visitor.context, cell, glm::ivec3(cell.lower), lanes))
            packet.set_limits(visitor.t_limit);
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
