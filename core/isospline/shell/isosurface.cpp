#include "isospline/shell/isosurface.h"

#include "isospline/math/affine.h"
#include "isospline/measure/component_measures.h"
#include "isospline/util/check.h"
#include "isospline/util/fork.h"
#include "isospline/util/lazy.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <mutex>
#include <string>
#include <utility>

namespace isospline {

namespace {

void check_volume(const std::shared_ptr<const Volume>& volume)
{
    if (!volume)
        throw_invalid("volume", "a volume", "none");
    if (volume->degree() < 1 || volume->degree() > 3)
        throw_invalid("volume", "a degree of 1, 2 or 3", volume->degree());
    const glm::ivec3 cells = volume->cell_shape();
    const auto text = to_text(glm::dvec3(volume->shape())) + " samples";
    if (cells.x < 1 || cells.y < 1 || cells.z < 1)
        throw_invalid("volume", "at least two samples along each axis for an odd degree", text);
    if (cells.x > 65535 || cells.y > 65535 || cells.z > 65535)
        throw_invalid("volume", "at most 65535 cells along each axis", text);
}

void check_level(double level)
{
    if (!is_finite(level))
        throw_invalid("level", "a finite number", level);
}

void check_shell(const ShellOptions& options, const Volume& volume)
{
    if (options.prune_depth < 0 || options.prune_depth > 6)
        throw_invalid("prune_depth", "0 to 6", options.prune_depth);
    const Mask& mask = options.mask;
    const glm::vec<3, std::size_t> shape(volume.shape());
    const std::size_t samples = shape.x * shape.y * shape.z;
    if (!mask.empty() && mask.size() != samples)
        throw_invalid("mask", "one byte for each of " + std::to_string(samples) + " samples", mask.size());
}

void check_clip(const IsosurfaceOptions& options)
{
    if (options.capped && !options.closed && options.clip.empty())
        throw_invalid("capped", "a clip whose cuts are capped, or closed=True for the border of the volume", "neither");
    for (const HalfSpace& half_space : options.clip) {
        check_direction("clip", half_space.normal);
        if (!is_finite(half_space.offset))
            throw_invalid("clip", "a finite offset", half_space.offset);
    }
}

} // namespace

/// Data that the first call computes.
struct IsosurfaceSnapshot::OnDemand {
    Lazy<Shell> shell;
    Lazy<Box> bounds;
    Lazy<SideGrid> sides;
};

IsosurfaceSnapshot::IsosurfaceSnapshot(std::shared_ptr<const Common> common, double level, const Progress& progress)
    : common_(std::move(common)), level_(level), kept_(find_kept(progress)),
      bricks_(volume(), *common_->ranges, level - volume().offset(), *kept_, clip_lattice(),
              part_of(progress, options().largest > 0 ? 0.9 : 0.0, 1.0)),
      on_demand_(std::make_shared<OnDemand>())
{
}

std::shared_ptr<const CellSet> IsosurfaceSnapshot::find_kept(const Progress& progress) const
{
    const auto& unmasked = common_->unmasked;
    if (options().largest == 0)
        return unmasked;
    const Solid solid{volume(), *common_->ranges, level_ - volume().offset(), inward_sign(), *unmasked, {}};
    return std::make_shared<const CellSet>(
        largest_components(solid, static_cast<std::size_t>(options().largest), part_of(progress, 0.0, 0.9)));
}

const Shell& IsosurfaceSnapshot::shell(const Progress& progress) const
{
    return on_demand_->shell.get(progress, [&] { return Shell(volume(), bricks_, options().shell, progress); });
}

Box IsosurfaceSnapshot::bounds_lattice(const Progress& progress) const
{
    return on_demand_->bounds.get(progress, [&] { return find_bounds(progress); });
}

const SideGrid& IsosurfaceSnapshot::sides(const Progress& progress) const
{
    return on_demand_->sides.get(
        progress, [&] { return SideGrid(*common_->ranges, volume().cell_shape(), threshold(), progress); });
}

BrickCells IsosurfaceSnapshot::cells(const Octet& octet, int child) const
{
    const Brick brick = bricks_.place(octet, child);
    BrickCells cells = bricks_.cells(brick);
    prune_bricks(volume(), threshold(), options().shell, {&brick, 1}, {&cells, 1});
    return cells;
}

bool IsosurfaceSnapshot::is_empty(const Progress& progress) const
{
    for (const Octet& octet : bricks_.octets()) {
        report(progress, 1.0); // the first octet nearly always decides
        for (unsigned rest = octet.bricks; rest != 0; rest &= rest - 1u)
            if (count_cells(cells(octet, std::countr_zero(rest))) > 0)
                return false;
    }
    return true;
}

std::vector<double> IsosurfaceSnapshot::reach_lattice(std::span<const glm::dvec3> directions,
                                                      const Progress& progress) const
{
    struct Place {
        glm::dvec3 first; // cell
        const Octet* octet;
        int child;
        bool is_seen;
    };
    std::vector<Place> places;
    places.reserve(bricks_.count());
    for (const Octet& octet : bricks_.octets())
        for (unsigned rest = octet.bricks; rest != 0; rest &= rest - 1u) {
            const int child = std::countr_zero(rest);
            places.push_back({glm::dvec3(bricks_.place(octet, child).first), &octet, child, false});
        }
    // The extent of a cube of one cell, from its first corner.
    const auto reach_of_cell = [](const glm::dvec3& direction) {
        return std::max(direction.x, 0.0) + std::max(direction.y, 0.0) + std::max(direction.z, 0.0);
    };
    std::vector<double> reach(directions.size(), -std::numeric_limits<double>::infinity());
    const auto extend = [&](Place& place) {
        report(progress, 0.0);
        place.is_seen = true;
        for_each_cell(cells(*place.octet, place.child), [&](int x, int y, int z) {
            const glm::dvec3 first = place.first + glm::dvec3(x, y, z);
            for (std::size_t i = 0; i < directions.size(); ++i)
                reach[i] = std::max(reach[i], glm::dot(directions[i], first) + reach_of_cell(directions[i]));
        });
    };
    // Look at the farthest bricks first, until the remaining ones cannot reach farther.
    for (std::size_t i = 0; i < directions.size(); ++i) {
        const glm::dvec3& direction = directions[i];
        const auto is_nearer = [&](const Place& a, const Place& b) {
            return glm::dot(direction, a.first) < glm::dot(direction, b.first);
        };
        std::make_heap(places.begin(), places.end(), is_nearer);
        for (auto end = places.end(); end != places.begin(); --end) {
            if (glm::dot(direction, places.front().first) + brick_size * reach_of_cell(direction) <= reach[i])
                break;
            if (!places.front().is_seen)
                extend(places.front());
            std::pop_heap(places.begin(), end, is_nearer);
        }
    }
    return reach;
}

Box IsosurfaceSnapshot::find_bounds(const Progress& progress) const
{
    const std::array<glm::dvec3, 6> axes{glm::dvec3(-1.0, 0.0, 0.0), {0.0, -1.0, 0.0}, {0.0, 0.0, -1.0},
                                         glm::dvec3(1.0, 0.0, 0.0),  {0.0, 1.0, 0.0},  {0.0, 0.0, 1.0}};
    const std::vector<double> reach = reach_lattice(axes, progress);
    return {-glm::dvec3(reach[0], reach[1], reach[2]), {reach[3], reach[4], reach[5]}};
}

std::size_t IsosurfaceSnapshot::memory() const
{
    const Shell* const shell = on_demand_->shell.found();
    const std::size_t of_shell = shell != nullptr ? shell->memory() : 0;
    const SideGrid* const sides = on_demand_->sides.found();
    const std::size_t of_sides = sides != nullptr ? sides->memory() : 0;
    return bricks_.memory() + common_->ranges->memory() + kept_->memory() + of_shell + of_sides;
}

Isosurface::Isosurface(std::shared_ptr<const Volume> volume, double level, IsosurfaceOptions options,
                       std::shared_ptr<const BrickRanges> ranges, const Progress& progress)
{
    check_volume(volume);
    check_shell(options.shell, *volume);
    if (options.largest < 0)
        throw_invalid("largest", "a number of at least 0", options.largest);
    check_clip(options);
    check_level(level);
    const double ranges_done = options.largest > 0 ? 0.2 : 0.9; // components take longer
    if (!ranges)
        ranges = isospline::shared_ranges(volume, part_of(progress, 0.0, ranges_done));
    SolidPlanes planes(*volume, options.clip, options.capped, options.closed);
    auto unmasked = std::make_shared<const CellSet>(options.shell.mask, *volume);
    const Box bounds = volume->bounds();
    const double error =
        coordinate_error(volume->world_to_lattice(), glm::max(glm::abs(bounds.lower), glm::abs(bounds.upper)));
    const auto common = std::make_shared<const IsosurfaceSnapshot::Common>(IsosurfaceSnapshot::Common{
        std::move(volume), std::move(ranges), std::move(options), std::move(planes), std::move(unmasked), error});
    snapshot_.reset(new IsosurfaceSnapshot(common, level, part_of(progress, ranges_done, 1.0)));
}

Isosurface::Isosurface(const Isosurface& other) : snapshot_(other.snapshot())
{
}

std::shared_ptr<const IsosurfaceSnapshot> Isosurface::snapshot() const
{
    const std::lock_guard lock(fork_safe_mutex(this));
    return snapshot_;
}

void Isosurface::set_level(double level, const Progress& progress)
{
    check_level(level);
    std::shared_ptr<const IsosurfaceSnapshot> changed(new IsosurfaceSnapshot(snapshot()->common_, level, progress));
    const std::lock_guard lock(fork_safe_mutex(this));
    snapshot_.swap(changed); // so that the previous one is destroyed after the lock is released
}

} // namespace isospline
