#include "isospline/trace/ray_stream.h"

#include "isospline/spline/degree.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/ray_stream.cpp"
#include <hwy/foreach_target.h>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "isospline/cell/candidate_cells-inl.h"
#include "isospline/cell/lane_mask-inl.h"
#include "isospline/trace/leaf-inl.h"

#include <array>
#include <bit>
#include <limits>
#include <utility>

#ifndef ISOSPLINE_TRACE_RAY_STREAM_LANES
#define ISOSPLINE_TRACE_RAY_STREAM_LANES
namespace isospline {

/// For each set of lanes: these lanes, then the others.
inline constexpr auto chosen_first = [] {
    std::array<std::array<std::uint8_t, 8>, 256> orders{};
    for (std::size_t set = 0; set < orders.size(); ++set) {
        std::size_t place = 0;
        for (const unsigned wanted : {1u, 0u})
            for (std::uint8_t lane = 0; lane < 8; ++lane)
                if ((set >> lane & 1u) == wanted)
                    orders[set][place++] = lane;
    }
    return orders;
}();

} // namespace isospline
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

// Not below a ray's end, t >= 0.
HWY_INLINE float end_single(double t)
{
    return static_cast<float>(t) * (1.0f + 0x1p-23f);
}

// The rays under way. Branches that depend on a ray are slow, because neighbouring rays differ: the code below has as
// few of them as it can.
template <int Degree>
class StreamTracer {
    static constexpr int capacity = LatticeRayPacket::capacity;

    // The nodes and leaves that a ray has still to visit, the nearest ones last. Two entries at the bottom, which are
    // infinitely far, stay.
    struct Stack {
        static constexpr std::size_t bottom = 2;
        static constexpr std::size_t capacity =
            bottom + LeafTree::largest_depth * (LeafTree::width - 1) + LeafTree::width;

        std::size_t size;
        float t[capacity];
        std::uint32_t children[capacity];
    };

    // The ray of a lane.
    struct Walk {
        double origin[3];
        float direction_single[3], inverse_direction_single[3];
        float scaled_origin[3];     // origin * inverse direction
        std::size_t near_bounds[3]; // where the bounds begin through which the ray enters children of a node
        float t_begin, t_end;
        std::uint32_t next; // node or leaf
        std::uint32_t leaf; // the last one
        unsigned flip;      // bit i: the ray goes down along axis i
        unsigned cells;     // of the leaf, still to be solved, front to back
        int cell;           // to be solved next
        alignas(32) float enters[Block::capacity];
        Stack stack;
    };

public:
    StreamTracer(const LeafTree& tree, const Leaves& leaves, float margin, const CellIntersector& intersector,
                 const RayStream& stream)
        : tree_(tree), leaves_(leaves), margin_(margin), intersector_(intersector), stream_(stream)
    {
        cells_.are_copied = true;
    }

    HWY_INLINE void run()
    {
        for (int lane = 0; lane < capacity; ++lane)
            begin(lane);
        do {
            while (waiting_ != 0) {
                const std::uint64_t waiting = std::exchange(waiting_, 0u);
                for (auto rest = static_cast<LaneMask>(waiting); rest != 0; rest &= rest - 1u)
                    visit_node(lowest_lane(rest));
                for (auto rest = static_cast<LaneMask>(waiting >> 32); rest != 0; rest &= rest - 1u)
                    visit_leaf(lowest_lane(rest));
            }
            solve();
        } while (waiting_ != 0 || at_cell_ != 0);
    }

private:
    void begin(int lane)
    {
        if (!stream_.next(stream_.context, lane, rays_))
            return;
        Walk& walk = walks_[lane];
        walk.flip = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            walk.origin[axis] = rays_.origin[axis][lane];
            walk.direction_single[axis] = rays_.direction_single[axis][lane];
            const float inverse = rays_.inverse_direction_single[axis][lane];
            walk.inverse_direction_single[axis] = inverse;
            walk.scaled_origin[axis] = static_cast<float>(walk.origin[axis]) * inverse;
            const unsigned goes_down = inverse < 0.0f;
            walk.near_bounds[axis] = LeafTree::Node::first_bound(axis) + goes_down * LeafTree::width;
            walk.flip |= goes_down << axis;
        }
        walk.t_begin = begin_single(rays_.t_near[lane]);
        walk.t_end = end_single(rays_.t_far[lane]);
        t_limit_[lane] = rays_.t_far[lane];
        walk.cells = 0;
        walk.stack.size = Stack::bottom;
        walk.stack.t[0] = walk.stack.t[1] = std::numeric_limits<float>::infinity();
        walk.stack.children[0] = walk.stack.children[1] = 0;
        go_to(walk, lane, 0);
    }

    // Begins to load a node or leaf. A leaf is half as large as a node, so the next one comes with it; it is often the
    // ray's next.
    HWY_INLINE void go_to(Walk& walk, int lane, std::uint32_t child)
    {
        static_assert(sizeof(LeafTree::Node) == 2 * sizeof(Leaf));
        const std::uint32_t is_leaf = child >> 31;
        walk.next = child;
        waiting_ |= std::uint64_t{1} << (static_cast<unsigned>(lane) + 32u * is_leaf);
        const auto* const nodes = reinterpret_cast<const char*>(tree_.nodes.data());
        const auto* const leaves = reinterpret_cast<const char*>(&leaves_[0]);
        const std::size_t place = child & ~LeafTree::leaf_bit;
        const char* const lines = (is_leaf != 0 ? leaves : nodes) + (place * sizeof(LeafTree::Node) >> is_leaf);
        hwy::Prefetch(lines);
        hwy::Prefetch(lines + sizeof(Leaf));
    }

    HWY_INLINE void go_on(Walk& walk, int lane)
    {
        if (walk.stack.size == Stack::bottom)
            return begin(lane);
        go_to(walk, lane, walk.stack.children[--walk.stack.size]);
    }

    HWY_INLINE void visit_node(int lane)
    {
        Walk& walk = walks_[lane];
        Stack& stack = walk.stack;
        std::size_t size = stack.size;
        push_children(walk, tree_.nodes[walk.next], size);
        // Where crossings count in any order, an order costs more than it saves.
        if ((stream_.record != nullptr || stream_.list != nullptr) && size > stack.size + 2)
            sort(stack, stack.size, size);
        // The nearer one of the two on top is next. One of them may be older, and the order does not change the result.
        const std::size_t nearer = size - 1 - (stack.t[size - 2] < stack.t[size - 1]);
        const std::size_t other = 2 * size - 3 - nearer;
        const std::uint32_t next = stack.children[nearer];
        stack.t[size - 2] = stack.t[other];
        stack.children[size - 2] = stack.children[other];
        if (size == Stack::bottom)
            return begin(lane);
        stack.size = size - 1;
        go_to(walk, lane, next);
    }

    // Puts the children that the ray meets on the stack.
    static HWY_INLINE void push_children(Walk& walk, const LeafTree::Node& node, std::size_t& size)
    {
        const Children d;
        const hn::Rebind<std::uint8_t, Children> to_byte;
        const hn::RebindToSigned<Children> to_signed;
        const hn::RebindToUnsigned<Children> to_unsigned;
        for (std::size_t first = 0; first < LeafTree::width; first += hn::Lanes(d)) {
            auto t_near = hn::Set(d, walk.t_begin), t_far = hn::Set(d, walk.t_end);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto inverse = hn::Set(d, walk.inverse_direction_single[axis]);
                const auto step = hn::Mul(hn::Set(d, node.step[axis]), inverse);
                const auto origin =
                    hn::MulSub(hn::Set(d, node.origin[axis]), inverse, hn::Set(d, walk.scaled_origin[axis]));
                const auto t_of = [&](std::size_t bounds) HWY_ATTR {
                    const auto planes = hn::PromoteTo(to_signed, hn::LoadU(to_byte, node.bounds + bounds + first));
                    return hn::MulAdd(hn::ConvertTo(d, planes), step, origin);
                };
                t_near = hn::Max(t_near, t_of(walk.near_bounds[axis]));
                t_far = hn::Min(t_far, t_of(walk.near_bounds[axis] ^ LeafTree::width));
            }
            const unsigned met = to_lane_mask(d, hn::Le(t_near, t_far), 0);
            const auto order =
                hn::IndicesFromVec(d, hn::PromoteTo(to_signed, hn::LoadU(to_byte, chosen_first[met].data())));
            const auto children = hn::BitCast(d, hn::LoadU(to_unsigned, node.children + first));
            // All lanes are written, those that the ray does not meet beyond the new size.
            hn::StoreU(hn::BitCast(to_unsigned, hn::TableLookupLanes(children, order)), to_unsigned,
                       walk.stack.children + size);
            hn::StoreU(hn::TableLookupLanes(t_near, order), d, walk.stack.t + size);
            size += static_cast<std::size_t>(std::popcount(met));
        }
    }

    // Sorts entries of the stack, the nearest ones last.
    static HWY_INLINE void sort(Stack& stack, std::size_t begin, std::size_t end)
    {
        for (std::size_t i = begin + 1; i < end; ++i) {
            const float t = stack.t[i];
            const std::uint32_t child = stack.children[i];
            std::size_t place = i;
            for (; place > begin && stack.t[place - 1] < t; --place) {
                stack.t[place] = stack.t[place - 1];
                stack.children[place] = stack.children[place - 1];
            }
            stack.t[place] = t;
            stack.children[place] = child;
        }
    }

    HWY_INLINE void visit_leaf(int lane)
    {
        Walk& walk = walks_[lane];
        walk.leaf = walk.next & ~LeafTree::leaf_bit;
        const Leaf& leaf = leaves_[walk.leaf];
        const unsigned met = cells_met(leaf, walk, walk.t_begin, walk.t_end, margin_, walk.enters);
        walk.cells = front_to_back(met, walk.flip);
        if (walk.cells != 0)
            go_to_cell(walk, lane);
        else
            go_on(walk, lane);
    }

    HWY_INLINE void go_to_cell(Walk& walk, int lane)
    {
        walk.cell = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(walk.cells) ^ walk.flip);
        walk.cells &= walk.cells - 1u;
        at_cell_ |= LaneMask{1} << lane;
        const CoefficientView cell = coefficients_of(walk);
        for (int k = 0; k <= Degree; ++k)
            for (int j = 0; j <= Degree; ++j)
                hwy::Prefetch(cell.first + j * cell.row_stride + k * cell.slice_stride);
    }

    HWY_INLINE CoefficientView coefficients_of(const Walk& walk) const
    {
        const glm::ivec3 offset = child_position(walk.cell);
        const CoefficientView first{leaves_[walk.leaf].coefficients, leaves_.row_stride(), leaves_.slice_stride()};
        return first.from(offset.x, offset.y, offset.z);
    }

    // Solves the cells of all rays.
    HWY_INLINE void solve()
    {
        if (at_cell_ == 0)
            return;
        cells_.lanes = std::exchange(at_cell_, 0u);
        for (LaneMask rest = cells_.lanes; rest != 0; rest &= rest - 1u) {
            const int lane = lowest_lane(rest);
            const Walk& walk = walks_[lane];
            const glm::ivec3 lower = leaves_[walk.leaf].first_cell() + child_position(walk.cell);
            copy_to_lane<Degree>(coefficients_of(walk), lower, lane, cells_);
        }
        if (stream_.record != nullptr)
            record_roots();
        else if (stream_.list != nullptr)
            list_roots();
        else if (stream_.occlude != nullptr)
            end_occluded();
        else
            count_roots();
        for (LaneMask rest = cells_.lanes; rest != 0; rest &= rest - 1u) {
            const int lane = lowest_lane(rest);
            Walk& walk = walks_[lane];
            if (walk.cells != 0)
                go_to_cell(walk, lane);
            else
                go_on(walk, lane);
        }
    }

    HWY_INLINE void record_roots()
    {
        RootPacket roots;
        const LaneMask found = intersector_.first_roots(cells_, leaves_.threshold(), rays_, t_limit_, roots);
        for (LaneMask rest = found; rest != 0; rest &= rest - 1u) {
            const int lane = lowest_lane(rest);
            t_limit_[lane] =
                stream_.record(stream_.context, lane, rays_.limits[lane], roots.root(lane), cells_.lower_of(lane));
            end_at(walks_[lane], end_single(t_limit_[lane]));
        }
    }

    HWY_INLINE void list_roots()
    {
        const auto list = [](void* self, int lane, const CrossingInCell& crossing, double t_begin) {
            auto& of = *static_cast<StreamTracer*>(self);
            of.t_limit_[lane] = of.stream_.list(of.stream_.context, lane, crossing, t_begin, of.cells_.lower_of(lane));
        };
        intersector_.visit_roots(cells_, leaves_.threshold(), rays_, {list, this});
        for (LaneMask rest = cells_.lanes; rest != 0; rest &= rest - 1u) {
            const int lane = lowest_lane(rest);
            if (const float t_end = end_single(t_limit_[lane]); t_end < walks_[lane].t_end)
                end_at(walks_[lane], t_end);
        }
    }

    HWY_INLINE void end_occluded()
    {
        for (LaneMask rest = intersector_.any_roots(cells_, leaves_.threshold(), rays_); rest != 0; rest &= rest - 1u) {
            const int lane = lowest_lane(rest);
            stream_.occlude(stream_.context, lane);
            end(lane);
        }
    }

    HWY_INLINE void count_roots()
    {
        std::uint8_t counts[capacity];
        for (LaneMask rest = intersector_.count_roots(cells_, leaves_.threshold(), rays_, counts); rest != 0;
             rest &= rest - 1u)
            if (const int lane = lowest_lane(rest); stream_.count(stream_.context, lane, counts[lane]))
                end(lane);
    }

    HWY_INLINE void end(int lane)
    {
        walks_[lane].cells = 0;
        walks_[lane].stack.size = Stack::bottom;
    }

    // Drops what begins beyond a new end.
    HWY_INLINE void end_at(Walk& walk, float t_end)
    {
        walk.t_end = t_end;
        Stack& stack = walk.stack;
        std::size_t kept = Stack::bottom;
        for (std::size_t i = Stack::bottom; i < stack.size; ++i) {
            stack.t[kept] = stack.t[i];
            stack.children[kept] = stack.children[i];
            kept += stack.t[i] <= t_end;
        }
        stack.size = kept;
        for (unsigned rest = walk.cells; rest != 0; rest &= rest - 1u)
            if (walk.enters[hwy::Num0BitsBelowLS1Bit_Nonzero32(rest) ^ walk.flip] > t_end)
                walk.cells &= ~(rest & (0u - rest));
    }

    const LeafTree& tree_;
    const Leaves& leaves_;
    float margin_;
    const CellIntersector& intersector_;
    const RayStream& stream_;
    std::uint64_t waiting_ = 0; // lanes whose rays are on their way to a node; from bit 32 on, to a leaf
    LaneMask at_cell_ = 0;      // lanes whose rays have a cell to be solved
    LatticeRayPacket rays_;
    CandidateCells cells_;
    alignas(64) double t_limit_[capacity] = {};
    Walk walks_[capacity];
};

template <int Degree>
HWY_NOINLINE void trace_stream_of_degree(const LeafTree& tree, const Leaves& leaves, float margin,
                                         const CellIntersector& intersector, const RayStream& stream)
{
    StreamTracer<Degree>(tree, leaves, margin, intersector, stream).run();
}

void TraceStream(const LeafTree& tree, const Leaves& leaves, float margin, const CellIntersector& intersector,
                 const RayStream& stream)
{
    dispatch_degree(leaves.degree(),
                    [&](auto n) { trace_stream_of_degree<n>(tree, leaves, margin, intersector, stream); });
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(TraceStream);

void trace_stream(const LeafTree& tree, const Leaves& leaves, float margin, const CellIntersector& intersector,
                  const RayStream& stream)
{
    HWY_DYNAMIC_DISPATCH(TraceStream)(tree, leaves, margin, intersector, stream);
}

} // namespace isospline
#endif
