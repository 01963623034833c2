// Divides the lines of a packet's rays into parts, in SIMD lanes: docs/method.md, "Certified rays". Included once for
// each SIMD target.
#include "isospline/brick/side_grid.h"
#include "isospline/cell/lane_mask-inl.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/certified_lines-inl.h"
#include "isospline/trace/certified_placement.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#if defined(ISOSPLINE_TRACE_CERTIFIED_WALK_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_CERTIFIED_WALK_INL_H
#undef ISOSPLINE_TRACE_CERTIFIED_WALK_INL_H
#else
#define ISOSPLINE_TRACE_CERTIFIED_WALK_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// Parts of lines, each said to be in a cell.
class CertifiedPartList {
public:
    using N = CertifiedNumber;
    enum Column : std::size_t {
        lane,
        value_error,
        t_begin,
        t_end,
        cell,
        local_begin = cell + 3,
        local_end = local_begin + 3,
        count = local_end + 3
    };
    /// Parts that there is room for, before those that are added at once.
    static constexpr std::size_t capacity = 2 * packet_capacity;

    std::size_t size() const { return size_; }
    void clear() { size_ = 0; }
    const double* operator[](std::size_t column) const { return numbers_[column]; }
    double at(std::size_t column, std::size_t part) const { return numbers_[column][part]; }
    glm::ivec3 cell_of(std::size_t part) const
    {
        return {static_cast<int>(at(cell, part)), static_cast<int>(at(cell + 1, part)),
                static_cast<int>(at(cell + 2, part))};
    }

    /// Adds the parts of a mask, given all columns.
    HWY_INLINE void add(hn::Mask<CertifiedDoubles> mask, const std::array<N, count>& columns)
    {
        std::size_t added = 0;
        for (std::size_t i = 0; i < count; ++i)
            added = hn::CompressStore(columns[i], mask, CertifiedDoubles(), numbers_[i] + size_);
        size_ += added;
    }

    void add(const CertifiedPartList& from, std::size_t part)
    {
        for (std::size_t i = 0; i < count; ++i)
            numbers_[i][size_] = from.numbers_[i][part];
        ++size_;
    }

    /// Repeats the last part, so that vectors that begin with parts of the list are full of them.
    void fill_up()
    {
        for (double* const column : numbers_)
            std::fill_n(column + size_, packet_capacity, column[size_ - 1]);
    }

private:
    std::size_t size_ = 0;
    alignas(64) double numbers_[count][capacity + packet_capacity];
};

/// Divides lines into parts, in order, until a part contains the ray's hint. A part is in a box of blocks of a SideGrid
/// in which f has one sign, or else in a cell. It may be beside it by the rounding of the t of a plane. As points
/// computed along an axis never go back, it is farther beside it at none of its points than where its line crosses one
/// of the planes.
class CertifiedWalk {
public:
    CertifiedWalk(const IsosurfaceSnapshot& surface, const certified::Placement& placement, const CertifiedLines& lines,
                  const double* t_hints)
        : sides_(surface.sides()), shape_(surface.volume().cell_shape()), slope_(placement.slope * (1.0 + 0x1p-20)),
          lines_(lines), t_hints_(t_hints)
    {
    }

    /// Adds the parts in cells to `parts`, and calls pass() when these are at least `packet_capacity`; adds those with
    /// a hint to `ends`. Sets the sign of f on the other parts, `sides`, to 0 if there are none. Returns the lanes in
    /// which f has one sign on them.
    template <class Pass>
    LaneMask run(CertifiedPartList& parts, CertifiedPartList& ends, double* sides, const Pass& pass)
    {
        constexpr std::size_t group_count = packet_capacity / certified_width;
        Group groups[group_count];
        for (std::size_t i = 0; i < group_count; ++i)
            begin(i * certified_width, groups[i]);
        // A step is a chain of operations that wait for each other, and for memory; those of several groups overlap.
        bool is_active = true;
        for (std::size_t count = 0; is_active && count < most_steps; ++count) {
            is_active = false;
            for (Group& group : groups)
                find_side(group);
            for (Group& group : groups)
                if (!hn::AllFalse(CertifiedDoubles(), group.active)) {
                    step(group, parts, ends);
                    if (parts.size() >= packet_capacity)
                        pass();
                    is_active = true;
                }
        }
        LaneMask passed = 0;
        for (const Group& group : groups)
            passed |= end(group, sides);
        return passed;
    }

private:
    using N = CertifiedNumber;
    using Mask = hn::Mask<CertifiedDoubles>;
    static constexpr std::size_t most_steps = 100'000;

    /// Lines that walk together, of the lanes from `first` on.
    struct Group {
        std::size_t first;
        Vector3<N> start, along, inverse;
        N lane, t_hint, value_error;
        N t, t_last;
        Vector3<N> cell;
        Vector3<N> block; ///< of the cell, in the SideGrid
        N side;           ///< its number
        N least, most;    ///< of these numbers so far, and 0
        N farthest;       ///< that a part is beside its box, along an axis
        Mask is_forward[3], is_parallel[3], active;
    };

    HWY_INLINE static N point(const Group& group, int axis, N t) { return group.start[axis] + t * group.along[axis]; }

    HWY_INLINE void begin(std::size_t first, Group& group) const
    {
        const CertifiedDoubles d;
        const N zero = number<N>(0.0);
        group.first = first;
        group.t = hn::Load(d, lines_.begin + first);
        group.t_last = hn::Load(d, lines_.end + first);
        group.least = group.most = group.farthest = zero;
        group.lane = hn::Iota(d, static_cast<double>(first));
        group.t_hint = hn::LoadU(d, t_hints_ + first);
        group.value_error = hn::Load(d, lines_.value_error + first);
        for (int axis = 0; axis < 3; ++axis) {
            group.start[axis] = hn::Load(d, lines_.start[axis] + first);
            group.along[axis] = hn::Load(d, lines_.along[axis] + first);
            group.inverse[axis] = hn::Load(d, lines_.inverse[axis] + first);
            group.is_forward[axis] = less(zero, group.along[axis]);
            group.is_parallel[axis] = equal(group.inverse[axis], zero);
            // How far the line is outside of the domain at its ends.
            const N one_end = point(group, axis, group.t), size = number<N>(shape_[axis]);
            for (const N each : {one_end, point(group, axis, group.t_last)})
                group.farthest = larger(larger(negated(each), each - size), group.farthest);
            // The t of a plane and its point have five roundings. A line that is nearly parallel to the planes of an
            // axis never crosses one.
            const N moved = absolute(group.along[axis]) * (group.t_last - group.t);
            const N rounding = number<N>(0x1p-50) * (absolute(group.start[axis]) + size);
            group.farthest = larger(select(group.is_parallel[axis], moved, rounding), group.farthest);
            group.cell[axis] = rounded_to_floor(smaller(larger(one_end, zero), size - number<N>(1.0)));
        }
        group.active = to_mask(d, lines_.usable(), first);
    }

    HWY_INLINE void step(Group& group, CertifiedPartList& parts, CertifiedPartList& ends) const
    {
        const CertifiedDoubles d;
        const N zero = number<N>(0.0), one = number<N>(1.0), edge = number<N>(sides_.edge());
        const N distance = absolute(group.side);
        const Mask is_mixed = equal(group.side, zero);
        Vector3<N> lower, upper, exits;
        for (int axis = 0; axis < 3; ++axis) {
            const N first = larger((group.block[axis] + one - distance) * edge, zero);
            const N last = smaller((group.block[axis] + distance) * edge, number<N>(shape_[axis]));
            lower[axis] = select(is_mixed, group.cell[axis], first);
            upper[axis] = select(is_mixed, group.cell[axis] + one, last);
            exits[axis] = exit(axis, lower[axis], upper[axis], group);
        }
        const N t_exit = smaller(larger(smaller(smaller(exits[0], exits[1]), exits[2]), group.t), group.t_last);
        group.least = select(group.active, smaller(group.side, group.least), group.least);
        group.most = select(group.active, larger(group.side, group.most), group.most);
        const Mask in_cell = both(both(group.active, less(group.t, t_exit)), is_mixed);
        group.active = both(group.active, less(t_exit, group.t_last));
        if (!hn::AllFalse(d, in_cell)) {
            const Mask is_end =
                both(in_cell, both(less_equal(group.t, group.t_hint), less_equal(group.t_hint, t_exit)));
            group.active = without(group.active, is_end);
            add(without(in_cell, is_end), is_end, group, t_exit, parts, ends);
        }
        advance(exits, lower, upper, t_exit, group);
        group.t = t_exit;
    }

    HWY_INLINE LaneMask end(const Group& group, double* sides) const
    {
        const CertifiedDoubles d;
        const N zero = number<N>(0.0);
        const N side = with_sign_of(number<N>(1.0), group.least + group.most);
        hn::Store(select(equal(group.least, group.most), zero, side), d, sides + group.first);
        const Mask differs = both(less(group.least, zero), less(zero, group.most));
        const N error = group.value_error + number<N>(3.0 * slope_) * group.farthest;
        const Mask is_near = less(error, number<N>((1.0 - 0x1p-10) * sides_.margin()));
        const Mask walked = without(to_mask(d, lines_.usable(), group.first), either(group.active, differs));
        return to_lane_mask(d, both(walked, is_near), group.first);
    }

    /// Looks up the block of each cell, and its number.
    HWY_INLINE void find_side(Group& group) const
    {
        const CertifiedDoubles d;
        const hn::Rebind<std::int32_t, CertifiedDoubles> integers;
        const Vector3<N>& block = group.block;
        for (int axis = 0; axis < 3; ++axis)
            group.block[axis] = rounded_to_floor(group.cell[axis] * number<N>(1.0 / sides_.edge()));
        const glm::ivec3& shape = sides_.shape();
        const N item = mul_add(mul_add(block[2], number<N>(shape.y), block[1]), number<N>(shape.x), block[0]);
        alignas(64) std::int32_t items[certified_width], numbers[certified_width];
        hn::Store(hn::DemoteTo(integers, select(group.active, item, number<N>(0.0))), integers, items);
        for (std::size_t i = 0; i < certified_width; ++i) // faster than instructions that gather
            numbers[i] = sides_.numbers()[static_cast<std::size_t>(items[i])];
        group.side = hn::PromoteTo(d, hn::Load(integers, numbers));
    }

    /// Where lines leave boxes along an axis; infinite at the border of the domain.
    HWY_INLINE N exit(int axis, N lower, N upper, const Group& group) const
    {
        const N last = select(group.is_forward[axis], number<N>(shape_[axis]), number<N>(0.0));
        const N plane = select(group.is_forward[axis], upper, lower);
        const Mask stays = either(equal(plane, last), group.is_parallel[axis]);
        const N t = (plane - group.start[axis]) * group.inverse[axis];
        return select(stays, number<N>(std::numeric_limits<double>::infinity()), t);
    }

    /// Moves to the cells behind the first exits. The other coordinates stay in the box.
    HWY_INLINE static void advance(const Vector3<N>& exits, const Vector3<N>& lower, const Vector3<N>& upper, N t,
                                   Group& group)
    {
        const Mask y_first = less(exits[1], exits[0]), z_first = less(exits[2], smaller(exits[1], exits[0]));
        const Mask leaves[3] = {hn::Not(either(y_first, z_first)), without(y_first, z_first), z_first};
        const N one = number<N>(1.0);
        for (int axis = 0; axis < 3; ++axis) {
            const N place = rounded_to_floor(point(group, axis, t));
            const N within = smaller(larger(place, lower[axis]), upper[axis] - one);
            const N beyond = select(group.is_forward[axis], upper[axis], lower[axis] - one);
            group.cell[axis] = select(leaves[axis], beyond, within);
        }
    }

    /// Adds the parts of these lanes of a group, up to t_end.
    HWY_INLINE static void add(Mask to_parts, Mask to_ends, const Group& group, N t_end, CertifiedPartList& parts,
                               CertifiedPartList& ends)
    {
        const CertifiedDoubles d;
        std::array<N, CertifiedPartList::count> columns;
        columns[CertifiedPartList::lane] = group.lane;
        columns[CertifiedPartList::value_error] = group.value_error;
        columns[CertifiedPartList::t_begin] = group.t;
        columns[CertifiedPartList::t_end] = t_end;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const int at = static_cast<int>(axis);
            columns[CertifiedPartList::cell + axis] = group.cell[axis];
            columns[CertifiedPartList::local_begin + axis] = point(group, at, group.t) - group.cell[axis];
            columns[CertifiedPartList::local_end + axis] = point(group, at, t_end) - group.cell[axis];
        }
        if (!hn::AllFalse(d, to_parts))
            parts.add(to_parts, columns);
        if (!hn::AllFalse(d, to_ends))
            ends.add(to_ends, columns);
    }

    const SideGrid& sides_;
    glm::dvec3 shape_; ///< of the domain, in cells
    double slope_;
    const CertifiedLines& lines_;
    const double* t_hints_;
};

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
