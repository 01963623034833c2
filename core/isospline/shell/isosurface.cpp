#include "isospline/shell/isosurface.h"

#include "isospline/util/check.h"
#include "isospline/util/fork.h"
#include "isospline/util/turn.h"

#include <glm/common.hpp>

#include <algorithm>
#include <atomic>
#include <bit>
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

void check_clip(const std::vector<HalfSpace>& clip)
{
    for (const HalfSpace& half_space : clip) {
        check_direction("clip", half_space.normal);
        if (!is_finite(half_space.offset))
            throw_invalid("clip", "a finite offset", half_space.offset);
    }
}

} // namespace

/// What is found by whoever asks first.
struct IsosurfaceSnapshot::OnDemand {
    template <typename Item>
    struct Lazy {
        template <typename Find>
        const Item& get(const Progress& progress, const Find& find)
        {
            if (!is_found) {
                const Turn::Taken taken(turn, progress);
                if (!is_found) {
                    item = find();
                    is_found = true;
                }
            }
            return item;
        }

        Turn turn; ///< to find it
        std::atomic<bool> is_found = false;
        Item item;
    };

    Lazy<Shell> shell;
    Lazy<Box> bounds;
};

IsosurfaceSnapshot::IsosurfaceSnapshot(std::shared_ptr<const Common> common, double level, const Progress& progress)
    : common_(std::move(common)), level_(level),
      bricks_(volume(), common_->source, *common_->ranges, level - volume().offset(), options().shell.mask,
              clip_lattice(), progress),
      on_demand_(std::make_shared<OnDemand>())
{
}

const Shell& IsosurfaceSnapshot::shell(const Progress& progress) const
{
    return on_demand_->shell.get(progress, [&] { return Shell(volume(), bricks_, options().shell, progress); });
}

Box IsosurfaceSnapshot::bounds_lattice() const
{
    return on_demand_->bounds.get({}, [&] { return find_bounds(); });
}

BrickCells IsosurfaceSnapshot::cells(const Octet& octet, int child) const
{
    const Brick brick = bricks_.place(octet, child);
    BrickCells cells = bricks_.cells(brick);
    prune_bricks(volume(), threshold(), options().shell, {&brick, 1}, {&cells, 1});
    return cells;
}

bool IsosurfaceSnapshot::is_empty() const
{
    for (const Octet& octet : bricks_.octets())
        for (unsigned rest = octet.bricks; rest != 0; rest &= rest - 1u)
            if (count_cells(cells(octet, std::countr_zero(rest))) > 0)
                return false;
    return true;
}

Box IsosurfaceSnapshot::find_bounds() const
{
    // Along each axis bricks are looked at from both ends, until those that are left cannot widen the box.
    struct Place {
        glm::ivec3 first; // cell
        const Octet* octet;
        int child;
    };
    std::vector<Place> places;
    places.reserve(bricks_.count());
    for (const Octet& octet : bricks_.octets())
        for (unsigned rest = octet.bricks; rest != 0; rest &= rest - 1u) {
            const int child = std::countr_zero(rest);
            places.push_back({bricks_.place(octet, child).first, &octet, child});
        }
    Box bounds;
    const auto extend = [&](const Place& place) {
        for_each_cell(cells(*place.octet, place.child), [&](int x, int y, int z) {
            const glm::dvec3 lower(place.first + glm::ivec3(x, y, z));
            bounds.extend(Box{lower, lower + 1.0});
        });
    };
    for (int axis = 0; axis < 3; ++axis) {
        std::sort(places.begin(), places.end(),
                  [axis](const Place& a, const Place& b) { return a.first[axis] < b.first[axis]; });
        for (std::size_t i = 0; i < places.size() && places[i].first[axis] < bounds.lower[axis]; ++i)
            extend(places[i]);
        for (std::size_t i = places.size(); i-- > 0 && places[i].first[axis] + brick_size > bounds.upper[axis];)
            extend(places[i]);
    }
    return bounds;
}

std::size_t IsosurfaceSnapshot::memory() const
{
    const std::size_t of_shell = on_demand_->shell.is_found ? on_demand_->shell.item.memory() : 0;
    return bricks_.memory() + common_->ranges->memory() + of_shell;
}

Isosurface::Isosurface(std::shared_ptr<const Volume> volume, double level, IsosurfaceOptions options,
                       std::shared_ptr<const BrickRanges> ranges, const Progress& progress,
                       std::shared_ptr<const CoefficientSource> source)
{
    check_volume(volume);
    check_shell(options.shell, *volume);
    check_clip(options.clip);
    check_level(level);
    auto common = std::make_shared<IsosurfaceSnapshot::Common>();
    for (const HalfSpace& half_space : options.clip)
        common->clip_lattice.push_back(pull_back(half_space, volume->lattice_to_world()));
    common->ranges = ranges ? std::move(ranges) : isospline::shared_ranges(volume);
    common->source = source ? std::move(source) : std::make_shared<const VolumeSource>(volume);
    common->options = std::move(options);
    common->volume = std::move(volume);
    snapshot_.reset(new IsosurfaceSnapshot(std::move(common), level, progress));
}

Isosurface::Isosurface(const Isosurface& other) : snapshot_(other.snapshot())
{
}

std::shared_ptr<const IsosurfaceSnapshot> Isosurface::snapshot() const
{
    const std::lock_guard lock(moment_mutex(this));
    return snapshot_;
}

void Isosurface::set_level(double level, const Progress& progress)
{
    check_level(level);
    std::shared_ptr<const IsosurfaceSnapshot> changed(new IsosurfaceSnapshot(snapshot()->common_, level, progress));
    const std::lock_guard lock(moment_mutex(this));
    snapshot_.swap(changed); // so that the one before goes after the lock
}

} // namespace isospline
