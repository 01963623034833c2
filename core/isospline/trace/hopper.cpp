#include "isospline/trace/hopper.h"

#include "isospline/math/affine.h"
#include "isospline/shell/brick.h"
#include "isospline/trace/cell_walk.h"
#include "isospline/trace/surface_hit.h"
#include "isospline/util/error.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

namespace {

/// One byte a cell: the paper's b and, where strides are wanted, whether the cell's brick is empty.
enum CellState : std::uint8_t { cell_empty, cell_of_shell, cell_of_empty_brick };

/// Place of (x, y, z) in a grid with x varying fastest; (0, 0, shape.z) gives the number of places.
std::size_t linear_index(const glm::ivec3& at, const glm::ivec3& shape)
{
    const glm::vec<3, std::size_t> position(at), size(shape);
    return position.x + size.x * (position.y + size.y * position.z);
}

} // namespace

double HopStatistics::mean_hop_length() const
{
    const std::uint64_t count = hops + strides;
    return count == 0 ? 0.0 : length / static_cast<double>(count);
}

HopStatistics& HopStatistics::operator+=(const HopStatistics& other)
{
    hops += other.hops;
    strides += other.strides;
    evaluated_cells += other.evaluated_cells;
    length += other.length;
    return *this;
}

VoxelHopper::VoxelHopper(std::shared_ptr<const IsosurfaceSnapshot> surface, const VoxelHopperOptions& options)
    : surface_(std::move(surface)), options_(options),
      intersector_(cell_intersector(surface_->volume().degree(), surface_->options().method)),
      shape_(surface_->volume().cell_shape())
{
    if (surface_->options().capped)
        throw_invalid("surface", "one whose cuts are open, as only scenes have caps", "one that is capped");
    const glm::ivec3 bricks = brick_shape(shape_);
    const std::size_t brick_count = linear_index({0, 0, bricks.z}, bricks);
    const std::size_t cell_count = linear_index({0, 0, shape_.z}, shape_);

    // The shell is ordered by brick: count the cells of each, then sum up.
    const std::vector<Cell>& cells = surface_->shell().cells();
    states_.assign(cell_count, cell_empty);
    brick_begin_.assign(brick_count + 1, 0);
    for (const Cell& cell : cells) {
        states_[cell_index({cell.x, cell.y, cell.z})] = cell_of_shell;
        ++brick_begin_[brick_index({cell.x, cell.y, cell.z}) + 1];
    }
    for (std::size_t brick = 0; brick < brick_count; ++brick)
        brick_begin_[brick + 1] += brick_begin_[brick];

    if (options_.strides)
        for (std::size_t index = 0; index < brick_count; ++index) {
            if (brick_begin_[index] != brick_begin_[index + 1])
                continue;
            const Brick brick = brick_at(shape_, index);
            for (int z = 0; z < brick.size.z; ++z)
                for (int y = 0; y < brick.size.y; ++y)
                    std::fill_n(&states_[cell_index(brick.first + glm::ivec3(0, y, z))], brick.size.x,
                                cell_of_empty_brick);
        }
    frame_ = RayFrame(transform_box(surface_->volume().lattice_to_world(), domain_lattice(surface_->volume())));
    world_to_lattice_ = glm::inverse(surface_->volume().lattice_to_world());
    centred_to_lattice_ = centred_to_local(surface_->volume().lattice_to_world(), frame_);
}

std::size_t VoxelHopper::cell_index(const glm::ivec3& cell) const
{
    return linear_index(cell, shape_);
}

std::size_t VoxelHopper::brick_index(const glm::ivec3& cell) const
{
    return linear_index(cell / brick_size, brick_shape(shape_));
}

std::uint32_t VoxelHopper::position_in_shell(const Cell& cell) const
{
    const std::size_t brick = brick_index({cell.x, cell.y, cell.z});
    const auto begin = surface_->shell().cells().begin();
    const auto found =
        std::lower_bound(begin + brick_begin_[brick], begin + brick_begin_[brick + 1], cell, is_before_in_brick);
    return static_cast<std::uint32_t>(found - begin);
}

std::optional<VoxelHopper::CellHit> VoxelHopper::hop(const LatticeRay& ray, HopStatistics& statistics) const
{
    const Volume& volume = surface_->volume();
    const double threshold = surface_->threshold();
    std::optional<CellHit> hit;
    std::optional<CellWalk> walk = CellWalk::enter(ray, shape_);
    if (!walk)
        return hit;
    // Behind a hit at the very end of a cell, the next cells may have one at the same t.
    double t_limit = ray.t_far;
    const double t_begin = std::max(ray.t_near, walk->t_begin());
    double t_reached = t_begin;
    while (walk->inside_grid()) {
        const std::uint8_t state = states_[walk->index()];
        if (state == cell_of_shell) {
            ++statistics.evaluated_cells;
            const Cell cell{static_cast<std::uint16_t>(walk->cell().x), static_cast<std::uint16_t>(walk->cell().y),
                            static_cast<std::uint16_t>(walk->cell().z)};
            const auto root = intersector_.first_root(CellBlock(volume, threshold, cell), ray);
            if (root && (!hit || (root->t == hit->root.t && position_in_shell(cell) < position_in_shell(hit->cell)))) {
                hit = {*root, cell};
                t_limit = root->t;
            }
        }

        const bool strides = state == cell_of_empty_brick;
        const std::optional<double> t_exit =
            strides ? walk->stride(ray, t_limit, brick_size, shape_) : walk->hop(ray, t_limit);
        if (!t_exit)
            break;
        ++(strides ? statistics.strides : statistics.hops);
        t_reached = *t_exit;
    }
    statistics.length += (t_reached - t_begin) * glm::length(ray.direction);
    return hit;
}

HopStatistics VoxelHopper::cast_rays(std::span<const Ray> rays, std::span<Hit> hits) const
{
    ISOSPLINE_ASSERT(rays.size(), ==, hits.size());
    HopStatistics statistics;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        Hit& hit = hits[i] = Hit();
        PreparedRay prepared;
        if (!prepare(rays[i], i, frame_, prepared))
            continue;
        LatticeRay ray = to_lattice(prepared, centred_to_lattice_, shape_);
        const std::optional<Interval> kept =
            clip({ray.origin, ray.direction, ray.t_near, ray.t_far}, surface_->clip_lattice());
        if (!kept)
            continue;
        ray.t_near = kept->t_near;
        ray.t_far = kept->t_far;
        const auto found = hop(ray, statistics);
        if (!found)
            continue;

        hit.t = ray.limits.given_t(found->root.t);
        hit.position = rays[i].at(hit.t);
        hit.geometry_id = 0;
        hit.primitive_id = position_in_shell(found->cell);
        set_surface_normal(hit, found->root.gradient, surface_->options().inside, world_to_lattice_);
    }
    return statistics;
}

std::size_t VoxelHopper::memory() const
{
    return states_.capacity() * sizeof(states_[0]) + brick_begin_.capacity() * sizeof(brick_begin_[0]);
}

} // namespace isospline
