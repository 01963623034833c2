// The cells along a ray, in order: J. Amanatides and A. Woo, "A fast voxel traversal algorithm for ray
// tracing", Eurographics 1987.
#pragma once

#include "isospline/cell/lattice_ray.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>

namespace isospline {

/// Walks through the cells of a grid that a ray meets, from face to face. A ray through an edge or a corner visits one
/// of the cells between, with a segment of length zero in it.
class CellWalk {
public:
    /// Begins in the cell of the ray's t_near, or where the ray enters the grid, whichever is later. Nothing if the ray
    /// does not meet the grid before its t_far.
    static std::optional<CellWalk> enter(const LatticeRay& ray, const glm::ivec3& shape)
    {
        CellWalk walk(ray, shape);
        double t_end = ray.t_far;
        for (int axis = 0; axis < 3; ++axis) {
            if (walk.step_[axis] == 0) {
                if (!(ray.plane_origin[axis] > 0.0 && ray.plane_origin[axis] < shape[axis]))
                    return std::nullopt;
                continue;
            }
            const double to_lower = walk.t_of_plane(ray, axis, 0), to_upper = walk.t_of_plane(ray, axis, shape[axis]);
            walk.t_begin_ = std::max(walk.t_begin_, std::min(to_lower, to_upper));
            t_end = std::min(t_end, std::max(to_lower, to_upper));
        }
        if (!(walk.t_begin_ <= t_end))
            return std::nullopt;

        // The planes determine the cell, and not the rounded position.
        const glm::dvec3 start = ray.at(walk.t_begin_);
        for (int axis = 0; axis < 3; ++axis) {
            const int step = walk.step_[axis];
            int cell = static_cast<int>(step == 0 ? ray.plane_origin[axis]
                                                  : std::clamp(std::floor(start[axis]), 0.0, shape[axis] - 1.0));
            while (step != 0 && cell - step >= 0 && cell - step < shape[axis] &&
                   walk.t_of_plane(ray, axis, cell + (step < 0)) >= walk.t_begin_)
                cell -= step;
            walk.move_to(ray, axis, cell);
        }
        return walk;
    }

    /// The t where the walk begins.
    double t_begin() const { return t_begin_; }
    bool inside_grid() const { return !left_grid_; }

    /// Moves to the next cell. Returns the t of the face between, or nothing, without moving, if that is past t_limit.
    std::optional<double> hop(const LatticeRay& ray, double t_limit)
    {
        const int axis = axis_of_least(t_exit_);
        const double t = t_exit_[axis];
        if (!(t <= t_limit))
            return std::nullopt;
        move_to(ray, axis, cell_[axis] + step_[axis]);
        return t;
    }

    /// Crosses the rest of the walk's brick, whose edge has `size` cells. Returns the t where it leaves the brick, or
    /// nothing, without moving, if that is past t_limit.
    std::optional<double> stride(const LatticeRay& ray, double t_limit, int size, const glm::ivec3& shape)
    {
        const glm::ivec3 first = cell_ / size * size;
        const glm::ivec3 last = glm::min(first + size, shape) - 1;
        glm::dvec3 t_exit;
        for (int axis = 0; axis < 3; ++axis)
            t_exit[axis] = t_of_plane(ray, axis, step_[axis] > 0 ? last[axis] + 1 : first[axis]);
        const int leaving = axis_of_least(t_exit);
        const double t = t_exit[leaving];
        if (!(t <= t_limit))
            return std::nullopt;

        // Along the other axes, the walk only goes forward and stays beside the brick, even with rounding errors.
        const glm::ivec3 position(ray.at(t));
        for (int axis = 0; axis < 3; ++axis) {
            const bool forward = step_[axis] > 0;
            const int lowest = forward ? cell_[axis] : first[axis], highest = forward ? last[axis] : cell_[axis];
            if (axis == leaving)
                move_to(ray, axis, forward ? last[axis] + 1 : first[axis] - 1);
            else if (step_[axis] != 0)
                move_to(ray, axis, std::clamp(position[axis], lowest, highest));
        }
        return t;
    }

    const glm::ivec3& cell() const { return cell_; }
    /// Index of the cell in the grid, x varying fastest.
    std::size_t index() const { return static_cast<std::size_t>(index_); }

private:
    CellWalk(const LatticeRay& ray, const glm::ivec3& shape)
        : pitch_(1, shape.x, static_cast<std::ptrdiff_t>(shape.x) * shape.y), t_begin_(ray.t_near)
    {
        for (int axis = 0; axis < 3; ++axis) {
            const bool has_planes = ray.plane_origin[axis] == ray.origin[axis] && ray.direction[axis] != 0.0;
            step_[axis] = has_planes ? (ray.direction[axis] > 0.0 ? 1 : -1) : 0;
            end_[axis] = step_[axis] > 0 ? shape[axis] : -1;
        }
    }

    /// The t of each plane is computed directly and not as a sum of steps, whose rounding errors would accumulate.
    double t_of_plane(const LatticeRay& ray, int axis, int plane) const
    {
        return step_[axis] == 0 ? std::numeric_limits<double>::infinity() : ray.t_of_plane(axis, plane);
    }

    void move_to(const LatticeRay& ray, int axis, int to)
    {
        index_ += (to - cell_[axis]) * pitch_[axis];
        cell_[axis] = to;
        t_exit_[axis] = t_of_plane(ray, axis, to + (step_[axis] > 0));
        left_grid_ |= to == end_[axis];
    }

    /// Without branches, because the next axis can hardly be predicted.
    static int axis_of_least(const glm::dvec3& t)
    {
        const int least = t.y < t.x;
        return t.z < std::min(t.x, t.y) ? 2 : least;
    }

    glm::vec<3, std::ptrdiff_t> pitch_;
    std::ptrdiff_t index_ = 0;
    glm::ivec3 cell_{0};
    glm::ivec3 step_;   ///< -1, 0 or 1
    glm::ivec3 end_;    ///< first index outside of the grid
    glm::dvec3 t_exit_; ///< where the ray leaves the cell along each axis
    double t_begin_;
    bool left_grid_ = false;
};

} // namespace isospline
