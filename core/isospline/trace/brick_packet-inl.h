// A packet of rays through the bricks of a box. Included once for each target.
//
// Down to the cells, all rays are tested together: SIMD lanes are the eight cubes, and each is tested against the range
// of the rays' t. Then each cell is tested against its rays: SIMD lanes are the rays.
#if defined(ISOSPLINE_TRACE_BRICK_PACKET_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_BRICK_PACKET_INL_H
#undef ISOSPLINE_TRACE_BRICK_PACKET_INL_H
#else
#define ISOSPLINE_TRACE_BRICK_PACKET_INL_H
#endif

#include "isospline/trace/brick_cubes-inl.h"
#include "isospline/trace/brick_trace.h"
#include "isospline/trace/packet_candidates-inl.h"

#include <hwy/cache_control.h>

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

// Rays of a packet whose directions have the same signs.
class PacketDescent {
    static constexpr int capacity = LatticeRayPacket::capacity;
    using V = hn::Vec<Children>;
    using Rays = hn::CappedTag<float, capacity>;
    using R = hn::Vec<Rays>;

    // The smallest and the largest t at which one of the rays enters a cube along each axis, and the distance of that
    // plane from the one where the box is entered, in cells.
    struct Entry {
        float least[3], most[3];
        float way[3];
    };

public:
    PacketDescent(const Bricks& bricks, const LatticeRayPacket& rays, float margin, LaneMask lanes, unsigned flip,
                  const PacketVisitor& visitor)
        : bricks_(bricks), rays_(rays), margin_(margin), lanes_(lanes), flip_(flip), visitor_(visitor),
          candidates_(bricks.degree(), visitor)
    {
        for (int axis = 0; axis < 3; ++axis)
            farther_[axis] = half_of_child[flip >> axis & 1u][axis];
    }

    // Prepares the rays for a cube of `edge` cells whose first cell is `first`.
    Entry enter(const glm::ivec3& first, int edge)
    {
        const hn::CappedTag<double, capacity> doubles;
        const hn::Rebind<float, decltype(doubles)> to_float;
        const Rays d;
        const R infinity = hn::Set(d, 1e38f);
        Entry entry;
        corner_ = first;
        for (int axis = 0; axis < 3; ++axis) {
            const auto corner = hn::Set(doubles, static_cast<double>(first[axis]));
            for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(doubles))
                hn::Store(hn::DemoteTo(to_float, hn::Sub(corner, hn::Load(doubles, rays_.origin[axis] + lane))),
                          to_float, to_corner_[axis] + lane);
            const R across = hn::Set(d, flip_ >> axis & 1u ? static_cast<float>(edge) : 0.0f);
            R least = infinity, most = hn::Neg(infinity), fewest = infinity, greatest = hn::Zero(d);
            for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(d)) {
                const auto used = to_mask(d, lanes_, lane);
                const R inverse = hn::Load(d, rays_.inverse_direction_single[axis] + lane);
                const R t = hn::Mul(hn::Add(hn::Load(d, to_corner_[axis] + lane), across), inverse);
                const R per_cell = hn::Abs(inverse);
                hn::Store(t, d, t_entry_[axis] + lane);
                hn::Store(per_cell, d, per_cell_[axis] + lane);
                least = hn::Min(least, hn::IfThenElse(used, t, infinity));
                most = hn::Max(most, hn::IfThenElse(used, t, hn::Neg(infinity)));
                fewest = hn::Min(fewest, hn::IfThenElse(used, per_cell, infinity));
                greatest = hn::Max(greatest, hn::IfThenElseZero(used, per_cell));
            }
            entry.way[axis] = 0.0f;
            entry.least[axis] = hn::GetLane(hn::MinOfLanes(d, least));
            entry.most[axis] = hn::GetLane(hn::MaxOfLanes(d, most));
            least_per_cell_[axis] = hn::GetLane(hn::MinOfLanes(d, fewest));
            most_per_cell_[axis] = hn::GetLane(hn::MaxOfLanes(d, greatest));
            margin_t_[axis] = margin_ * most_per_cell_[axis];
        }
        R begin = infinity;
        for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(doubles))
            hn::Store(hn::DemoteTo(to_float, hn::Load(doubles, rays_.t_near + lane)), to_float, t_near_ + lane);
        for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(d))
            begin = hn::Min(begin, hn::IfThenElse(to_mask(d, lanes_, lane), hn::Load(d, t_near_ + lane), infinity));
        t_begin_ = hn::GetLane(hn::MinOfLanes(d, begin));
        set_limits();
        return entry;
    }

    void descend_octet(const Octet& octet, const Entry& entry)
    {
        for_each_met(entry, brick_size, octet.bricks, [&](int child, const Entry& inner) HWY_ATTR {
            if (any_ray_meets(inner, brick_size))
                descend_brick(bricks_.brick(octet, child, pin_), inner);
        });
    }

    void descend_brick(const MadeBrick& brick, const Entry& entry)
    {
        const Blocks16 d;
        using B = hn::Vec<Blocks16>;
        float enters[3], leaves[3], way[3], through[3];
        for (int axis = 0; axis < 3; ++axis) {
            enters[axis] = entry.least[axis] - margin_t_[axis];
            leaves[axis] = entry.most[axis] + 2.0f * most_per_cell_[axis] + margin_t_[axis];
            way[axis] = 2.0f * least_per_cell_[axis];
            through[axis] = 2.0f * most_per_cell_[axis];
        }
        std::uint64_t met = 0;
        for (std::size_t first = 0; first < 16; first += hn::Lanes(d)) {
            const B x = hn::Load(d, place_of_block[flip_ & 1u][0] + first);
            const B y = hn::Load(d, place_of_block[flip_ >> 1 & 1u][1] + first);
            const B t_near =
                hn::Max(hn::Set(d, t_begin_), hn::Max(hn::MulAdd(x, hn::Set(d, way[0]), hn::Set(d, enters[0])),
                                                      hn::MulAdd(y, hn::Set(d, way[1]), hn::Set(d, enters[1]))));
            const B t_far =
                hn::Min(hn::Set(d, t_end_), hn::Min(hn::MulAdd(x, hn::Set(d, through[0]), hn::Set(d, leaves[0])),
                                                    hn::MulAdd(y, hn::Set(d, through[1]), hn::Set(d, leaves[1]))));
            for (unsigned z = 0; z < 4; ++z) {
                const float nth = static_cast<float>(flip_ >> 2 ? 3u - z : z);
                const auto meets = hn::Le(hn::Max(t_near, hn::Set(d, enters[2] + nth * way[2])),
                                          hn::Min(t_far, hn::Set(d, leaves[2] + nth * through[2])));
                met |= static_cast<std::uint64_t>(to_lane_mask(d, meets, first)) << 16 * z;
            }
        }
        met &= brick.blocks();
        if ((met & (met - 1u)) != 0)
            for (std::uint64_t rest = met; rest != 0; rest &= rest - 1u)
                hwy::Prefetch(static_cast<const char*>(
                    brick.address_of(static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero64(rest)))));
        for (std::uint64_t rest = blocks_front_to_back(met, flip_); rest != 0; rest &= rest - 1u) {
            const auto nth = static_cast<unsigned>(hwy::Num0BitsBelowLS1Bit_Nonzero64(rest));
            const Entry inner = advance(entry, {nth & 3u, nth >> 2 & 3u, nth >> 4}, 2);
            if (first_t(inner) <= t_end_ && any_ray_meets(inner, 2))
                descend_block(brick, static_cast<int>(flipped_block(nth, flip_)), inner);
        }
    }

    void descend_block(const MadeBrick& brick, int index, const Entry& entry)
    {
        Block own;
        const Block& block = brick.block(index, bricks_.degree(), bricks_.threshold(), own);
        const glm::ivec3 in_brick = block_position(index);
        for_each_met(entry, 1, block.cells, [&](int child, const Entry& inner) HWY_ATTR {
            const glm::ivec3 place(child & 1, child >> 1 & 1, child >> 2);
            const glm::ivec3 cell = brick.first() + in_brick + place;
            const LaneMask lanes = lanes_of_cell(block, child, cell - corner_, inner);
            if (lanes == 0)
                return;
            if (candidates_.add(brick.coefficients(in_brick + place), cell, lanes))
                set_limits();
        });
        if (candidates_.finish())
            set_limits();
    }

private:
    // Where the rays enter the cube that is the given multiples of `edge` farther along each axis.
    HWY_INLINE Entry advance(const Entry& entry, const glm::uvec3& by, int edge) const
    {
        Entry inner;
        for (int axis = 0; axis < 3; ++axis) {
            const auto way = static_cast<float>(static_cast<int>(by[axis]) * edge);
            inner.way[axis] = entry.way[axis] + way;
            inner.least[axis] = entry.least[axis] + way * least_per_cell_[axis];
            inner.most[axis] = entry.most[axis] + way * most_per_cell_[axis];
        }
        return inner;
    }

    // Before any ray enters a cube.
    HWY_INLINE float first_t(const Entry& entry) const
    {
        float t = entry.least[0] - margin_t_[0];
        for (int axis = 1; axis < 3; ++axis) {
            const float other = entry.least[axis] - margin_t_[axis];
            t = t < other ? other : t;
        }
        return t;
    }

    void set_limits()
    {
        const hn::CappedTag<double, capacity> doubles;
        const hn::Rebind<float, decltype(doubles)> to_float;
        const Rays d;
        for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(doubles)) {
            const auto limit =
                hn::Min(hn::Load(doubles, rays_.t_far + lane), hn::LoadU(doubles, visitor_.t_limit + lane));
            hn::Store(hn::DemoteTo(to_float, limit), to_float, t_limit_ + lane);
        }
        R end = hn::Set(d, -1e38f);
        for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(d))
            end = hn::Max(end, hn::IfThenElse(to_mask(d, lanes_, lane), hn::Load(d, t_limit_ + lane), end));
        t_end_ = hn::GetLane(hn::MaxOfLanes(d, end));
    }

    // Calls `visit` for the children of a cube, with half its edge, that a ray may meet.
    template <class Visit>
    HWY_INLINE void for_each_met(const Entry& entry, int half, unsigned present, const Visit& visit)
    {
        const Children d;
        const auto size = static_cast<float>(half);
        alignas(32) float begin[8];
        unsigned met = 0;
        for (std::size_t first = 0; first < 8; first += hn::Lanes(d)) {
            V t_near = hn::Set(d, t_begin_), t_far = hn::Set(d, t_end_);
            for (int axis = 0; axis < 3; ++axis) {
                const V farther = hn::Load(d, farther_[axis] + first);
                t_near = hn::Max(t_near, hn::MulAdd(farther, hn::Set(d, size * least_per_cell_[axis]),
                                                    hn::Set(d, entry.least[axis] - margin_t_[axis])));
                const float way = size * most_per_cell_[axis];
                t_far = hn::Min(
                    t_far, hn::MulAdd(farther, hn::Set(d, way), hn::Set(d, entry.most[axis] + way + margin_t_[axis])));
            }
            hn::Store(t_near, d, begin + first);
            met |= to_lane_mask(d, hn::Le(t_near, t_far), first);
        }
        for (unsigned rest = front_to_back(met & present, flip_); rest != 0; rest &= rest - 1u) {
            const unsigned nth = static_cast<unsigned>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest));
            const unsigned child = nth ^ flip_;
            if (begin[child] > t_end_)
                continue;
            visit(static_cast<int>(child), advance(entry, {nth & 1u, nth >> 1 & 1u, nth >> 2}, half));
        }
    }

    // Narrows [t_near, t_far] of the rays from `lane` on to a cube of `edge` cells.
    HWY_INLINE void meet(const Entry& entry, int edge, std::size_t lane, R& t_near, R& t_far) const
    {
        const Rays d;
        for (int axis = 0; axis < 3; ++axis) {
            const R per_cell = hn::Load(d, per_cell_[axis] + lane);
            const R t_entry = hn::Load(d, t_entry_[axis] + lane);
            const R to_near_side = hn::Set(d, entry.way[axis] - margin_);
            const R to_far_side = hn::Set(d, entry.way[axis] + static_cast<float>(edge) + margin_);
            t_near = hn::Max(t_near, hn::MulAdd(to_near_side, per_cell, t_entry));
            t_far = hn::Min(t_far, hn::MulAdd(to_far_side, per_cell, t_entry));
        }
    }

    // Whether one of the rays meets a cube of `edge` cells. The test of all rays together is wider: it also finds cubes
    // between the rays, and cubes behind the hits of some rays.
    HWY_INLINE bool any_ray_meets(const Entry& entry, int edge) const
    {
        const Rays d;
        LaneMask lanes = 0;
        for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(d)) {
            R t_near = hn::Load(d, t_near_ + lane), t_far = hn::Load(d, t_limit_ + lane);
            meet(entry, edge, lane, t_near, t_far);
            lanes |= to_lane_mask(d, hn::Le(t_near, t_far), lane);
        }
        return (lanes & lanes_) != 0;
    }

    // The rays that meet a cell and are in its slab for a part of their segment in it.
    HWY_INLINE LaneMask lanes_of_cell(const Block& block, int cell, const glm::ivec3& from_corner,
                                      const Entry& entry) const
    {
        const Rays d;
        const auto i = static_cast<std::size_t>(cell);
        LaneMask lanes = 0;
        for (std::size_t lane = 0; lane < capacity; lane += hn::Lanes(d)) {
            R t_near = hn::Load(d, t_near_ + lane), t_far = hn::Load(d, t_limit_ + lane);
            meet(entry, 1, lane, t_near, t_far);
            R along_direction = hn::Zero(d), to_cell = hn::Zero(d);
            for (int axis = 0; axis < 3; ++axis) {
                const R normal = hn::Set(d, static_cast<float>(block.slab_normal[axis][i]));
                const R to_lower =
                    hn::Add(hn::Load(d, to_corner_[axis] + lane), hn::Set(d, static_cast<float>(from_corner[axis])));
                along_direction = hn::MulAdd(normal, hn::Load(d, rays_.direction_single[axis] + lane), along_direction);
                to_cell = hn::MulAdd(normal, to_lower, to_cell);
            }
            const R at_entry = hn::MulSub(along_direction, t_near, to_cell);
            const R at_exit = hn::MulSub(along_direction, t_far, to_cell);
            const R upper = hn::Set(d, static_cast<float>(block.slab_upper[i]) + slab_margin_of(margin_));
            const R lower = hn::Set(d, static_cast<float>(block.slab_lower[i]) - slab_margin_of(margin_));
            const auto in_slab =
                hn::And(hn::Le(hn::Min(at_entry, at_exit), upper), hn::Ge(hn::Max(at_entry, at_exit), lower));
            lanes |= to_lane_mask(d, hn::And(hn::Le(t_near, t_far), in_slab), lane);
        }
        return lanes & lanes_;
    }

    const Bricks& bricks_;
    const LatticeRayPacket& rays_;
    float margin_;
    LaneMask lanes_;
    unsigned flip_;
    const PacketVisitor& visitor_;
    PacketCandidates candidates_;
    BrickPin pin_;
    const float* farther_[3];
    glm::ivec3 corner_;
    float t_begin_, t_end_;
    float least_per_cell_[3], most_per_cell_[3], margin_t_[3];
    alignas(64) float to_corner_[3][capacity]; // from the rays' origins to the first cell of the box
    alignas(64) float t_entry_[3][capacity];   // where rays enter the box along each axis
    alignas(64) float per_cell_[3][capacity];
    alignas(64) float t_near_[capacity], t_limit_[capacity];
};

inline void trace_packet(const Bricks& bricks, const ShellBox& box, const LatticeRayPacket& rays, float margin,
                         LaneMask active, const PacketVisitor& visitor)
{
    const Octet& octet = bricks.octets()[box.octet];
    while (active != 0) {
        // The rays with the signs of the first one.
        LaneMask lanes = active;
        unsigned flip = 0;
        const hn::CappedTag<float, LatticeRayPacket::capacity> d;
        const auto first_lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(active);
        for (int axis = 0; axis < 3; ++axis) {
            LaneMask down = 0;
            for (std::size_t lane = 0; lane < LatticeRayPacket::capacity; lane += hn::Lanes(d))
                down |=
                    to_lane_mask(d, hn::Lt(hn::Load(d, rays.inverse_direction_single[axis] + lane), hn::Zero(d)), lane);
            const bool goes_down = (down >> first_lane & 1u) != 0;
            flip |= static_cast<unsigned>(goes_down) << axis;
            lanes &= goes_down ? down : ~down;
        }
        active &= ~lanes;
        PacketDescent descent(bricks, rays, margin, lanes, flip, visitor);
        const glm::ivec3 octet_first(octet.first[0], octet.first[1], octet.first[2]);
        descent.descend_octet(octet, descent.enter(octet_first, 2 * brick_size));
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
