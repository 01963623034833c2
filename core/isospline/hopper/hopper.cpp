#include "isospline/hopper/hopper.h"

#include "isospline/brick/brick.h"
#include "isospline/cell/intersector.h"
#include "isospline/hopper/cell_walk.h"
#include "isospline/math/affine.h"
#include "isospline/trace/prepared_ray.h"
#include "isospline/trace/surface_hit.h"
#include "isospline/util/check.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

namespace isospline {

namespace {

/// One byte per cell: the paper's b and, for strides, whether the cell's brick is empty.
enum CellState : std::uint8_t { cell_empty, cell_of_shell, cell_of_empty_brick };

std::shared_ptr<const IsosurfaceSnapshot> checked(std::shared_ptr<const IsosurfaceSnapshot> surface)
{
    if (!surface)
        throw_invalid("surface", "the snapshot of an isosurface", "none");
    if (surface->planes().have_caps())
        throw_invalid("surface", "one without caps, as only scenes have them", "one that is capped or closed");
    return surface;
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

struct VoxelHopper::Impl {
    struct CellHit {
        RootInCell root;
        std::uint64_t primitive_id;
    };

    Impl(std::shared_ptr<const IsosurfaceSnapshot> surface_to_trace, bool strides);

    /// The hit of a ray, starting where it enters the grid.
    std::optional<CellHit> hop(const LatticeRay& ray, HopStatistics& statistics) const;
    Hit cast(const Ray& ray, std::size_t index, HopStatistics& statistics) const;

    const std::shared_ptr<const IsosurfaceSnapshot> surface;
    const CellIntersector intersector;
    const glm::ivec3 shape;           ///< cells along x, y, z
    std::vector<std::uint8_t> states; ///< one byte per cell, x fastest: whether it is in the shell
    RayFrame frame;                   ///< that of a scene with this surface alone, so that hits are equal, bit for bit
    glm::dmat4 world_to_lattice, centred_to_lattice;
};

VoxelHopper::Impl::Impl(std::shared_ptr<const IsosurfaceSnapshot> surface_to_trace, bool strides)
    : surface(checked(std::move(surface_to_trace))),
      intersector(cell_intersector(surface->volume().degree(), surface->options().method)),
      shape(surface->volume().cell_shape())
{
    const Volume& volume = surface->volume();
    states.assign(volume.cell_count(), strides ? cell_of_empty_brick : cell_empty);
    for (const Cell& cell : surface->shell().cells()) {
        const glm::ivec3 first = glm::ivec3(cell) / brick_size * brick_size;
        if (states[volume.primitive_id(first)] == cell_of_empty_brick) {
            const glm::ivec3 last = glm::min(first + brick_size, shape) - 1;
            for (int z = first.z; z <= last.z; ++z)
                for (int y = first.y; y <= last.y; ++y)
                    std::fill_n(&states[volume.primitive_id({first.x, y, z})], last.x - first.x + 1, cell_empty);
        }
        states[volume.primitive_id(cell)] = cell_of_shell;
    }
    frame = RayFrame(transform_box(volume.lattice_to_world(), domain_lattice(volume)));
    world_to_lattice = glm::inverse(volume.lattice_to_world());
    centred_to_lattice = centred_to_local(volume.lattice_to_world(), frame);
}

std::optional<VoxelHopper::Impl::CellHit> VoxelHopper::Impl::hop(const LatticeRay& ray, HopStatistics& statistics) const
{
    const Volume& volume = surface->volume();
    const double threshold = surface->threshold();
    std::optional<CellHit> hit;
    std::optional<CellWalk> walk = CellWalk::enter(ray, shape);
    if (!walk)
        return hit;
    // After a hit exactly at the end of a cell, the next cells may have a hit at the same t.
    double t_limit = ray.t_far;
    const double t_begin = std::max(ray.t_near, walk->t_begin());
    double t_reached = t_begin;
    while (walk->inside_grid()) {
        const std::uint8_t state = states[walk->index()];
        if (state == cell_of_shell) {
            ++statistics.evaluated_cells;
            const auto root = intersector.first_root(VolumeCell(volume, threshold, walk->cell()), ray);
            const std::uint64_t primitive_id = walk->index();
            if (root && (!hit || (root->t == hit->root.t && primitive_id < hit->primitive_id))) {
                hit = {*root, primitive_id};
                t_limit = root->t;
            }
        }

        const bool strides = state == cell_of_empty_brick;
        const std::optional<double> t_exit =
            strides ? walk->stride(ray, t_limit, brick_size, shape) : walk->hop(ray, t_limit);
        if (!t_exit)
            break;
        ++(strides ? statistics.strides : statistics.hops);
        t_reached = *t_exit;
    }
    statistics.length += (t_reached - t_begin) * glm::length(ray.direction);
    return hit;
}

Hit VoxelHopper::Impl::cast(const Ray& ray, std::size_t index, HopStatistics& statistics) const
{
    Hit hit;
    PreparedRay prepared;
    if (!prepare(ray, index, frame, prepared))
        return hit;
    LatticeRay in_lattice = to_lattice(prepared, centred_to_lattice, shape);
    const std::optional<Interval> kept =
        clip({in_lattice.origin, in_lattice.direction, in_lattice.t_near, in_lattice.t_far}, surface->clip_lattice());
    if (!kept)
        return hit;
    in_lattice.t_near = kept->t_near;
    in_lattice.t_far = kept->t_far;
    if (const auto found = hop(in_lattice, statistics)) {
        hit.t = in_lattice.limits.given_t(found->root.t);
        hit.position = ray.at(hit.t);
        hit.geometry_id = 0;
        hit.primitive_id = found->primitive_id;
        set_surface_normal(hit, found->root.gradient, surface->options().inside, world_to_lattice);
    }
    return hit;
}

VoxelHopper::VoxelHopper(std::shared_ptr<const IsosurfaceSnapshot> surface, const VoxelHopperOptions& options)
    : impl_(std::make_unique<const Impl>(std::move(surface), options.strides))
{
}

VoxelHopper::~VoxelHopper() = default;

HopStatistics VoxelHopper::cast_rays(std::span<const Ray> rays, std::span<Hit> hits) const
{
    check_one_per_ray("hits", rays.size(), hits.size());
    HopStatistics statistics;
    for (std::size_t i = 0; i < rays.size(); ++i)
        hits[i] = impl_->cast(rays[i], i, statistics);
    return statistics;
}

std::size_t VoxelHopper::memory() const
{
    return impl_->states.capacity() * sizeof(impl_->states[0]);
}

} // namespace isospline
