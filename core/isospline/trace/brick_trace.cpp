#include "isospline/trace/brick_trace.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/brick_trace.cpp"
#include <hwy/foreach_target.h>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "isospline/cell/candidate_cells-inl.h"
#include "isospline/trace/brick_cubes-inl.h"
#include "isospline/trace/brick_packet-inl.h"
#include "isospline/trace/leaf-inl.h"
#include "isospline/trace/packet_candidates-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

// One ray through the bricks of a box; SIMD lanes are the cubes that it may meet.
class RayDescent {
    using V = hn::Vec<Children>;

    // Where the ray enters a cube along each axis.
    struct Entry {
        float t[3];
    };

public:
    RayDescent(const Bricks& bricks, const LatticeRay& ray, float margin, double t_limit, const RayVisitor& visitor)
        : bricks_(bricks), ray_(ray), margin_(margin), t_limit_(static_cast<float>(t_limit)), visitor_(visitor)
    {
        // Not above the limit itself, because a hit may be there.
        const float begin = static_cast<float>(ray.t_near);
        t_near_ = begin - 0x1p-23f * (begin < 0.0f ? -begin : begin);
        for (int axis = 0; axis < 3; ++axis) {
            const float inverse = ray.inverse_direction_single[axis];
            const unsigned down = inverse < 0.0f;
            flip_ |= down << axis;
            per_cell_[axis] = down ? -inverse : inverse;
            margin_t_[axis] = margin * per_cell_[axis];
            farther_[axis] = half_of_child[down][axis];
        }
    }

    void descend_octet(const Octet& octet)
    {
        const Entry entry = enter({octet.first[0], octet.first[1], octet.first[2]}, 2 * brick_size);
        const Children d;
        unsigned met = 0;
        for (std::size_t first = 0; first < 8; first += hn::Lanes(d)) {
            V t_near = hn::Set(d, t_near_), t_far = hn::Set(d, t_limit_);
            meet(entry, brick_size, first, t_near, t_far);
            met |= to_lane_mask(d, hn::Le(t_near, t_far), first);
        }
        met &= octet.bricks;
        if ((met & (met - 1u)) != 0)
            for (unsigned rest = met; rest != 0; rest &= rest - 1u)
                if (const void* const brick = bricks_.address_of(octet, first_bit(rest)))
                    hwy::Prefetch(static_cast<const char*>(brick));
        for (unsigned rest = front_to_back(met, flip_); rest != 0; rest &= rest - 1u) {
            const auto nth = static_cast<unsigned>(first_bit(rest));
            const Entry inner = advance(entry, {nth & 1u, nth >> 1 & 1u, nth >> 2}, brick_size);
            if (first_t(inner) <= t_limit_)
                descend_brick(bricks_.brick(octet, static_cast<int>(nth ^ flip_), pin_), inner);
        }
    }

private:
    static HWY_INLINE int first_bit(unsigned bits)
    {
        return static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(bits));
    }

    HWY_INLINE Entry enter(const glm::ivec3& first, int edge) const
    {
        Entry entry;
        for (int axis = 0; axis < 3; ++axis) {
            const int plane = first[axis] + (flip_ >> axis & 1u ? edge : 0);
            entry.t[axis] = static_cast<float>(plane - ray_.origin[axis]) * ray_.inverse_direction_single[axis];
        }
        return entry;
    }

    // Where the ray enters the cube that is the given multiples of `edge` farther along each axis.
    HWY_INLINE Entry advance(const Entry& entry, const glm::uvec3& by, int edge) const
    {
        Entry inner;
        for (int axis = 0; axis < 3; ++axis)
            inner.t[axis] = entry.t[axis] + static_cast<float>(static_cast<int>(by[axis]) * edge) * per_cell_[axis];
        return inner;
    }

    // The approximate t where the ray enters a cube.
    HWY_INLINE float first_t(const Entry& entry) const
    {
        float t = entry.t[0] - margin_t_[0];
        for (int axis = 1; axis < 3; ++axis) {
            const float other = entry.t[axis] - margin_t_[axis];
            t = t < other ? other : t;
        }
        return t;
    }

    // Narrows [t_near, t_far] to the children of a cube, with half its edge, from lane `first` on.
    HWY_INLINE void meet(const Entry& entry, int half, std::size_t first, V& t_near, V& t_far) const
    {
        const Children d;
        for (int axis = 0; axis < 3; ++axis) {
            const float way = static_cast<float>(half) * per_cell_[axis];
            const V enters = hn::MulAdd(hn::Load(d, farther_[axis] + first), hn::Set(d, way),
                                        hn::Set(d, entry.t[axis] - margin_t_[axis]));
            t_near = hn::Max(t_near, enters);
            t_far = hn::Min(t_far, hn::Add(enters, hn::Set(d, way + 2.0f * margin_t_[axis])));
        }
    }

    void descend_brick(const MadeBrick& brick, const Entry& entry)
    {
        const Blocks16 d;
        using B = hn::Vec<Blocks16>;
        float enters[3], way[3], through[3];
        for (int axis = 0; axis < 3; ++axis) {
            enters[axis] = entry.t[axis] - margin_t_[axis];
            way[axis] = 2.0f * per_cell_[axis];
            through[axis] = way[axis] + 2.0f * margin_t_[axis];
        }
        std::uint64_t met = 0;
        for (std::size_t first = 0; first < 16; first += hn::Lanes(d)) {
            const B by_x = hn::MulAdd(hn::Load(d, place_of_block[flip_ & 1u][0] + first), hn::Set(d, way[0]),
                                      hn::Set(d, enters[0]));
            const B by_y = hn::MulAdd(hn::Load(d, place_of_block[flip_ >> 1 & 1u][1] + first), hn::Set(d, way[1]),
                                      hn::Set(d, enters[1]));
            const B t_near = hn::Max(hn::Set(d, t_near_), hn::Max(by_x, by_y));
            const B t_far = hn::Min(hn::Set(d, t_limit_), hn::Min(hn::Add(by_x, hn::Set(d, through[0])),
                                                                  hn::Add(by_y, hn::Set(d, through[1]))));
            for (unsigned z = 0; z < 4; ++z) {
                const float by_z = enters[2] + static_cast<float>(flip_ >> 2 ? 3u - z : z) * way[2];
                const auto meets =
                    hn::Le(hn::Max(t_near, hn::Set(d, by_z)), hn::Min(t_far, hn::Set(d, by_z + through[2])));
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
            if (first_t(inner) <= t_limit_)
                descend_block(brick, static_cast<int>(flipped_block(nth, flip_)), inner);
        }
    }

    // The cells whose slab contains a part of the ray's segment in the cell.
    void descend_block(const MadeBrick& brick, int index, const Entry& entry)
    {
        Block own;
        const Block& block = brick.block(index, bricks_.degree(), bricks_.threshold(), own);
        const glm::ivec3 in_brick = block_position(index);
        const glm::ivec3 corner = brick.first() + in_brick;
        const Children d;
        const hn::RebindToSigned<Children> to_int;
        const hn::Rebind<std::int8_t, Children> to_byte;
        unsigned met = 0;
        alignas(32) float begin[8];
        for (std::size_t first = 0; first < 8; first += hn::Lanes(d)) {
            const auto load = [&](const auto& bytes) HWY_ATTR {
                return hn::ConvertTo(d, hn::PromoteTo(to_int, hn::LoadU(to_byte, &bytes[0] + first)));
            };
            V t_near = hn::Set(d, t_near_), t_far = hn::Set(d, t_limit_);
            meet(entry, 1, first, t_near, t_far);
            V along_direction = hn::Zero(d), to_corner = hn::Zero(d);
            for (int axis = 0; axis < 3; ++axis) {
                const V normal = load(block.slab_normal[axis]);
                const V from_origin = hn::Set(d, static_cast<float>(corner[axis] - ray_.origin[axis]));
                along_direction = hn::MulAdd(normal, hn::Set(d, ray_.direction_single[axis]), along_direction);
                to_corner =
                    hn::MulAdd(normal, hn::Add(hn::Load(d, half_of_child[0][axis] + first), from_origin), to_corner);
            }
            const V at_entry = hn::MulSub(along_direction, t_near, to_corner);
            const V at_exit = hn::MulSub(along_direction, t_far, to_corner);
            const V slab_margin = hn::Set(d, slab_margin_of(margin_));
            const auto below_upper = hn::Le(hn::Min(at_entry, at_exit), hn::Add(load(block.slab_upper), slab_margin));
            const auto above_lower = hn::Ge(hn::Max(at_entry, at_exit), hn::Sub(load(block.slab_lower), slab_margin));
            hn::Store(t_near, d, begin + first);
            met |= to_lane_mask(d, hn::And(hn::Le(t_near, t_far), hn::And(below_upper, above_lower)), first);
        }
        for (unsigned rest = front_to_back(met & block.cells, flip_); rest != 0; rest &= rest - 1u) {
            const auto child = static_cast<unsigned>(first_bit(rest)) ^ flip_;
            if (begin[child] > t_limit_)
                continue;
            const glm::ivec3 place(child & 1u, child >> 1 & 1u, child >> 2);
            const glm::ivec3 cell = corner + place;
            const CellCoefficients coefficients(brick.coefficients(in_brick + place), bricks_.threshold(), cell);
            t_limit_ = static_cast<float>(visitor_.visit(visitor_.context, coefficients, cell));
        }
    }

    const Bricks& bricks_;
    const LatticeRay& ray_;
    float margin_;
    float t_limit_;
    const RayVisitor& visitor_;
    BrickPin pin_;
    float t_near_;
    unsigned flip_ = 0;
    float per_cell_[3];       // t for one cell along each axis
    float margin_t_[3];       // the margin, as t along each axis
    const float* farther_[3]; // for each child, whether it is the farther half
};

inline void trace_ray(const Bricks& bricks, const ShellBox& box, const LatticeRay& ray, float margin, double t_limit,
                      const RayVisitor& visitor)
{
    RayDescent(bricks, ray, margin, t_limit, visitor).descend_octet(bricks.octets()[box.octet]);
}

// The cells in which the rays of a packet begin.
inline void add_first_cells(const Volume& volume, const LatticeRayPacket& rays, LaneMask lanes, FirstCells& first,
                            CandidateCells& cells)
{
    const hn::CappedTag<double, packet_capacity> d;
    const hn::Rebind<std::int32_t, decltype(d)> to_int;
    const glm::ivec3 shape = volume.cell_shape();
    first.lanes = 0;
    for (std::size_t lane = 0; lane < packet_capacity; lane += hn::Lanes(d)) {
        const auto t = hn::Load(d, rays.t_near + lane);
        auto inside = hn::FirstN(d, hn::Lanes(d));
        for (int axis = 0; axis < 3; ++axis) {
            const auto begin =
                hn::MulAdd(t, hn::Load(d, rays.direction[axis] + lane), hn::Load(d, rays.origin[axis] + lane));
            const auto lower = hn::Floor(begin);
            const auto size = hn::Set(d, static_cast<double>(shape[axis]));
            inside = hn::And(inside, hn::And(hn::Ge(lower, hn::Zero(d)), hn::Lt(lower, size)));
            const auto limited = hn::Min(hn::Max(lower, hn::Zero(d)), size);
            hn::Store(hn::DemoteTo(to_int, limited), to_int, first.lower[axis] + lane);
        }
        first.lanes |= to_lane_mask(d, inside, lane);
    }
    first.lanes &= lanes;
    cells.lanes = 0;
    for (LaneMask rest = first.lanes; rest != 0;) {
        const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(rest);
        const glm::ivec3 cell(first.lower[0][lane], first.lower[1][lane], first.lower[2][lane]);
        const LaneMask of_cell = lanes_beginning_in(first, cell);
        add_candidate(volume.cell(cell, nullptr), volume.degree(), cell, of_cell, cells);
        rest &= ~of_cell;
    }
}

BrickTracer tracer_of_target()
{
    return {trace_ray, trace_packet, trace_leaf, trace_packet_in_leaf, add_first_cells};
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(tracer_of_target);

BrickTracer brick_tracer()
{
    return HWY_DYNAMIC_DISPATCH(tracer_of_target)();
}

} // namespace isospline
#endif
