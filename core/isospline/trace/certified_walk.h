// The cells along a line, in order. Nothing relies on the order being right: its user checks each part of the line.
#pragma once

#include "isospline/trace/certified_line.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace isospline::certified {

/// Walks through a box of cells that are cubes of `size` units. It never leaves the box: a line that does belongs to
/// its last cell.
class Walk {
public:
    Walk(const Line& line, const glm::dvec3& inverse_along, double size, const glm::ivec3& first,
         const glm::ivec3& last, double t)
        : line_(line), inverse_along_(inverse_along), size_(size), first_(first), last_(last)
    {
        const glm::dvec3 point = line.at(t) / size;
        for (int axis = 0; axis < 3; ++axis)
            enter(axis, static_cast<int>(std::clamp(std::floor(point[axis]), static_cast<double>(first[axis]),
                                                    static_cast<double>(last[axis]))));
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
