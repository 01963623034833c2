#include "isospline/scene/ray_coherence.h"

#include "isospline/math/grid.h"
#include "isospline/scene/scene_snapshot_impl.h"
#include "isospline/shell/isosurface.h"
#include "isospline/util/check.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <hwy/contrib/sort/vqsort.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <variant>

namespace isospline {

namespace {

/// Groups that are looked at.
constexpr std::size_t most_groups = 16;
/// Rays of a group suit packets if they enter and leave the box within this many cells. Packets of 4 x 4 rays break
/// even with single rays in Embree at about 12 cells.
constexpr double tight_spread = 10.0;
/// With a stream in place of Embree, single rays are faster: a packet breaks even with them at about this spread.
constexpr double stream_spread = 5.0;
/// The same where all that rays cross counts, and packets solve the cells of a leaf for several of them. Objects
/// without a stream are met in packets, too.
constexpr double depths_spread = 7.0;
/// The same where first hits are also those of objects without a stream, one by one in Embree.
constexpr double mixed_spread = 20.0;
/// Rays of a group within so many cells are those of a row of a picture, and tight once they are sorted.
constexpr double near_spread = 20.0;
/// Rays of a group that enter the box farther from each other read other parts of the index and the volume each.
constexpr double far_spread = 64.0;

/// Rays that are sorted together.
constexpr int place_bits = 17;
constexpr std::size_t sorted_block = std::size_t{1} << place_bits;
/// Keys have 33 bits.
constexpr std::uint64_t last_key = (std::uint64_t{1} << 33) - 1;

/// The edge of a cube with the volume of a cell, in the scene.
double cell_size(const IsosurfaceSnapshot& surface, const glm::dmat4& transform)
{
    const glm::dmat4 lattice_to_world = transform * surface.volume().lattice_to_world();
    return std::cbrt(std::abs(glm::determinant(glm::dmat3(lattice_to_world))));
}

/// About the size of triangles, for a mesh in a box with a diagonal of `size`.
double triangle_size(const Mesh& mesh, double size)
{
    return size / std::sqrt(static_cast<double>(mesh.faces().size()) + 1.0);
}

} // namespace

RayCoherence::RayCoherence(const SceneSnapshot::Impl& scene, bool SeenBy::*sees)
{
    double largest = -1.0;
    bool has_surface = false;
    for (const auto& instance : scene.instances) {
        const SnapshotObject& shown = instance->shown;
        const auto* const surface = std::get_if<std::shared_ptr<const IsosurfaceSnapshot>>(&shown.object);
        if (!(shown.seen_by.*sees) || (has_surface && surface == nullptr))
            continue;
        if (surface != nullptr && !has_surface) { // meshes do not count any more
            has_surface = true;
            box_ = {};
            largest = -1.0;
        }
        const Box box = placed_domain(instance->object->local(), shown.transform);
        const double size = glm::length(box.size());
        box_.extend(box);
        if (box.empty() || size <= largest)
            continue;
        largest = size;
        cell_ = surface != nullptr ? cell_size(**surface, shown.transform)
                                   : triangle_size(*std::get<std::shared_ptr<const Mesh>>(shown.object), size);
    }
}

std::optional<RayCoherence::Spread> RayCoherence::spread(std::size_t count, const RayAt& ray_at) const
{
    // Entries and exits, projected along the direction of the first ray.
    Box entries, exits;
    glm::dvec3 along(0.0);
    int rays = 0;
    const auto across = [&along](const glm::dvec3& point) { return point - glm::dot(point, along) * along; };
    for (std::size_t i = 0; i < count; ++i) {
        const Ray ray = ray_at(i);
        const std::optional<Interval> inside = clip(ray, box_);
        if (!inside || !is_finite(ray.origin) || !is_finite(ray.direction))
            continue;
        if (rays++ == 0)
            along = glm::normalize(ray.direction);
        entries.extend(across(ray.at(inside->t_near)));
        exits.extend(across(ray.at(inside->t_far)));
    }
    if (rays == 0)
        return std::nullopt;
    const double of_entries = glm::length(entries.size()) / cell_;
    return Spread{of_entries, std::max(of_entries, glm::length(exits.size()) / cell_), rays};
}

bool RayCoherence::suit_packets(std::span<const RayPacket> packets, bool meets_others, bool meets_all) const
{
    const double limit = meets_all ? depths_spread : meets_others ? mixed_spread : stream_spread;
    for (const RayPacket& rays : packets) {
        if (rays.count < 2)
            continue;
        // The rays at opposite corners of a tile, or at the ends of a row.
        const auto of_ends = spread(2, [&rays](std::size_t i) { return rays.ray(i == 0 ? 0 : rays.count - 1); });
        if (of_ends && of_ends->rays == 2)
            return of_ends->largest <= limit;
    }
    return false;
}

RayCoherence::Closeness RayCoherence::closeness(std::size_t count, const RayAt& ray_at) const
{
    const std::size_t groups = count / group_size;
    const std::size_t step = (groups + most_groups - 1) / most_groups;
    std::size_t tight = 0, near = 0, far = 0, seen = 0;
    for (std::size_t group = 0; group < groups; group += step) {
        const auto of_group = spread(group_size, [&](std::size_t i) { return ray_at(group * group_size + i); });
        if (!of_group)
            continue;
        ++seen;
        tight += of_group->largest <= tight_spread;
        near += of_group->largest <= near_spread;
        far += of_group->of_entries > far_spread;
    }
    const auto most = [seen](std::size_t some) { return seen > 0 && 4 * some >= 3 * seen; };
    return most(tight) ? Closeness::packets : most(near) || most(far) ? Closeness::sorting : Closeness::none;
}

std::uint64_t RayCoherence::key(const Ray& ray) const
{
    const std::optional<Interval> inside = clip(ray, box_);
    if (!inside)
        return last_key;
    constexpr double places = 1 << 10;
    const glm::dvec3 entry =
        glm::clamp((ray.at(inside->t_near) - box_.lower) / box_.size() * places, 0.0, places - 1.0);
    if (!is_finite(entry))
        return last_key;
    std::uint64_t octant = 0;
    for (int axis = 0; axis < 3; ++axis)
        octant = 2 * octant + (ray.direction[axis] < 0.0);
    return octant << 30 | morton_code(glm::ivec3(entry));
}

std::vector<std::size_t> RayCoherence::sorted(std::size_t count, const RayAt& ray_at, const Progress& progress) const
{
    // A key, and the place in the block, in one number.
    std::vector<std::size_t> order(count);
    parallel_for(
        count, sorted_block,
        [&](std::size_t begin, std::size_t end) {
            std::vector<std::uint64_t> keyed(end - begin);
            for (std::size_t i = begin; i < end; ++i)
                keyed[i - begin] = key(ray_at(i)) << place_bits | (i - begin);
            hwy::Sorter()(keyed.data(), keyed.size(), hwy::SortAscending());
            for (std::size_t i = begin; i < end; ++i)
                order[i] = begin + (keyed[i - begin] & (sorted_block - 1));
        },
        progress);
    return order;
}

} // namespace isospline
