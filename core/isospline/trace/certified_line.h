// The line of a ray in lattice space, with proven bounds: docs/method.md, "Certified rays".
#pragma once

#include "isospline/math/box.h"
#include "isospline/math/enclosure.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace isospline::certified {

/// A range of t whose ends are known within bounds.
struct Range {
    double begin, end;           ///< [begin, end] contains it; it is empty if begin > end
    double sure_begin, sure_end; ///< it contains [sure_begin, sure_end]
};

/// The points start + t along, whose coordinates are enclosures.
struct Line {
    std::array<Enclosure, 3> start, along;

    /// The point at t, rounded.
    glm::dvec3 at(double t) const
    {
        return {start[0].value + t * along[0].value, start[1].value + t * along[1].value,
                start[2].value + t * along[2].value};
    }

    /// A bound on the distance of at(t) from the point at t, summed over the axes, for |t| up to t_most. Local
    /// coordinates of the cell around it, which are rounded once more, are covered too.
    double error(double t_most) const
    {
        double sum = 0.0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            sum += start[axis].radius + t_most * along[axis].radius +
                   0x1p-51 * (std::abs(start[axis].value) + t_most * std::abs(along[axis].value));
        return sum * (1.0 + 0x1p-40) + 0x1p-900;
    }

    /// The t in [t_near, t_far] at which the point is in the box from 0 to `size`, borders included.
    Range clip(const glm::dvec3& size, double t_near, double t_far) const
    {
        Range range{t_near, t_far, t_near, t_far};
        std::array<bool, 3> is_parallel{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            is_parallel[axis] = along[axis].contains_zero();
            if (is_parallel[axis])
                continue;
            const Enclosure over_along = inverse(along[axis]);
            const Enclosure to_lower = -start[axis] * over_along;
            const Enclosure to_upper = (Enclosure(size[static_cast<int>(axis)]) - start[axis]) * over_along;
            const bool forward = along[axis].value > 0.0;
            const Enclosure &enter = forward ? to_lower : to_upper, &leave = forward ? to_upper : to_lower;
            range.begin = std::max(range.begin, enter.lower());
            range.end = std::min(range.end, leave.upper());
            range.sure_begin = std::max(range.sure_begin, enter.upper());
            range.sure_end = std::min(range.sure_end, leave.lower());
        }
        for (std::size_t axis = 0; axis < 3; ++axis)
            if (is_parallel[axis] && range.begin <= range.end)
                clip_parallel(axis, size[static_cast<int>(axis)], range);
        return range;
    }

private:
    /// Clips along an axis to which the line may be perpendicular.
    void clip_parallel(std::size_t axis, double size, Range& range) const
    {
        const bool exactly = along[axis].value == 0.0 && along[axis].radius == 0.0;
        const auto coordinate = [&](double t) { return exactly ? start[axis] : start[axis] + along[axis] * t; };
        const Enclosure first = coordinate(range.begin), last = coordinate(range.end);
        const double lower = std::min(first.lower(), last.lower()), upper = std::max(first.upper(), last.upper());
        if (upper < 0.0 || lower > size)
            range.end = -HUGE_VAL;
        if (!(lower >= 0.0 && upper <= size))
            range.sure_end = -HUGE_VAL;
    }
};

/// Walks along a line through a box of cells that are cubes of `size` units. It never leaves the box: a line that does
/// belongs to its last cell. Nothing relies on the order of the cells being right: each part of the line is checked.
class Walk {
public:
    Walk(const Line& line, const glm::dvec3& inverse_along, double size, const glm::ivec3& first,
         const glm::ivec3& last, double t)
        : line_(line), inverse_along_(inverse_along), size_(size), first_(first), last_(last)
    {
        const glm::dvec3 point = line.at(t) / size;
        for (int axis = 0; axis < 3; ++axis)
            enter(axis, static_cast<int>(std::clamp(point[axis], static_cast<double>(first[axis]),
                                                    static_cast<double>(last[axis])))); // rounds down
    }

    const glm::ivec3& cell() const { return cell_; }
    /// Where the line leaves the cell.
    double t_exit() const { return std::min(std::min(t_exit_.x, t_exit_.y), t_exit_.z); }
    void advance()
    {
        const int side = t_exit_.y < t_exit_.x, axis = t_exit_.z < t_exit_[side] ? 2 : side;
        enter(axis, cell_[axis] + (line_.along[static_cast<std::size_t>(axis)].value > 0.0 ? 1 : -1));
    }

private:
    void enter(int axis, int cell)
    {
        cell_[axis] = cell;
        const auto& start = line_.start[static_cast<std::size_t>(axis)];
        const double along = line_.along[static_cast<std::size_t>(axis)].value;
        const double t = (size_ * (cell + (along > 0.0)) - start.value) * inverse_along_[axis];
        const bool leaves = cell != (along > 0.0 ? last_ : first_)[axis];
        t_exit_[axis] = along != 0.0 && leaves && !std::isnan(t) ? t : std::numeric_limits<double>::infinity();
    }

    const Line& line_;
    glm::dvec3 inverse_along_;
    double size_;
    glm::ivec3 first_, last_, cell_{0};
    glm::dvec3 t_exit_{0.0};
};

} // namespace isospline::certified
