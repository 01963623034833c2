#include "visiting_order.h"

#include "isospline/cell/lattice_ray.h"
#include "isospline/hopper/cell_walk.h"
#include "isospline/math/affine.h"
#include "isospline/math/grid.h"
#include "isospline/shell/isosurface.h"
#include "isospline/util/check.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>
#include <variant>

namespace isospline {

namespace {

/// The isosurface of an object whose coefficients are on disk, or null.
const IsosurfaceSnapshot* on_disk(const SnapshotObject& object)
{
    const auto* const surface = std::get_if<std::shared_ptr<const IsosurfaceSnapshot>>(&object.object);
    return surface != nullptr && (*surface)->volume().source() != nullptr ? surface->get() : nullptr;
}

/// Where a point is in a volume, of which `world_to_index` may be the map of a placed one.
std::uint64_t key_of_point(const Volume& volume, const glm::dmat4& world_to_index, const glm::dvec3& point)
{
    const glm::dvec3 index = transform_point(world_to_index, point);
    if (!is_finite(index))
        return 0;
    return morton_code(glm::ivec3(glm::clamp(index, glm::dvec3(0.0), glm::dvec3(volume.shape() - 1))) / brick_size);
}

/// The octets of bricks that a surface may cross, in a grid of octets.
class CrossedOctets {
public:
    CrossedOctets(const IsosurfaceSnapshot& surface, const glm::dmat4& transform)
        : shape_(surface.shared_ranges()->shape()), is_crossed_(place_count(shape_))
    {
        constexpr int octet_size = 2 * brick_size;
        const glm::dmat4 lattice_to_octets = glm::scale(glm::dmat4(1.0), glm::dvec3(1.0 / octet_size));
        world_to_octets_ = lattice_to_octets * surface.volume().world_to_lattice() * glm::inverse(transform);
        for (const Octet& octet : surface.bricks().octets()) {
            const glm::ivec3 first(octet.first[0], octet.first[1], octet.first[2]);
            is_crossed_[place_in(shape_, first / octet_size)] = true;
        }
    }

    struct Entry {
        double t;
        glm::ivec3 octet;
    };

    /// Where a ray meets the first of them. The walk does not look beyond the ray's t_far.
    std::optional<Entry> entry(const Ray& ray_world) const
    {
        const Ray ray{transform_point(world_to_octets_, ray_world.origin),
                      transform_vector(world_to_octets_, ray_world.direction), ray_world.t_near, ray_world.t_far};
        if (!is_finite(ray.origin) || !is_finite(ray.direction))
            return std::nullopt;
        const LatticeRay lattice_ray(ray, shape_);
        std::optional<CellWalk> walk = CellWalk::enter(lattice_ray, shape_);
        if (!walk)
            return std::nullopt;
        std::optional<double> t = walk->t_begin();
        while (t && walk->inside_grid()) {
            if (is_crossed_[walk->index()])
                return Entry{*t, walk->cell()};
            t = walk->hop(lattice_ray, ray.t_far);
        }
        return std::nullopt;
    }

private:
    glm::ivec3 shape_;
    glm::dmat4 world_to_octets_{1.0};
    std::vector<bool> is_crossed_;
};

} // namespace

VisitingOrder::VisitingOrder(const Volume& volume, const RowArray& points)
{
    if (volume.source() == nullptr)
        return;
    sort(points.count(),
         [&](std::size_t row) { return key_of_point(volume, volume.world_to_index(), points.vector(row)); });
}

// With several surfaces, a query of a point reads all of them at about the same place.
VisitingOrder::VisitingOrder(const SceneSnapshot& scene, const RowArray& points)
{
    if (!scene.reads_sources())
        return;
    for (const std::uint32_t id : scene.ids()) {
        const SnapshotObject& object = scene.object(id);
        const IsosurfaceSnapshot* const surface = on_disk(object);
        if (surface == nullptr)
            continue;
        const Volume& volume = surface->volume();
        const glm::dmat4 world_to_index = volume.world_to_index() * glm::inverse(object.transform);
        sort(points.count(), [&](std::size_t row) { return key_of_point(volume, world_to_index, points.vector(row)); });
        return;
    }
}

VisitingOrder::VisitingOrder(const SceneSnapshot& scene, bool SeenBy::*sees, const RowArray& rays, double t_near,
                             double t_far)
{
    constexpr std::size_t few = 64; // rays, which are traced faster than octets are listed
    if (!scene.reads_sources() || rays.count() <= few)
        return;
    std::vector<CrossedOctets> surfaces;
    for (const std::uint32_t id : scene.ids()) {
        const SnapshotObject& object = scene.object(id);
        if (const IsosurfaceSnapshot* const surface = on_disk(object); surface != nullptr && object.seen_by.*sees)
            surfaces.emplace_back(*surface, object.transform);
    }
    if (surfaces.empty())
        return;
    sort(rays.count(), [&](std::size_t row) {
        Ray ray{rays.vector(row, 0), rays.vector(row, 3), t_near, t_far};
        std::uint64_t key = std::numeric_limits<std::uint64_t>::max();
        for (std::size_t i = 0; i < surfaces.size(); ++i)
            if (const std::optional<CrossedOctets::Entry> entry = surfaces[i].entry(ray); entry) {
                // Codes of octets have 36 bits, as a volume has at most 65535 cells along an axis.
                key = std::uint64_t{i} << 36 | morton_code(entry->octet);
                ray.t_far = entry->t;
            }
        return key;
    });
}

void VisitingOrder::sort(std::size_t count, const std::function<std::uint64_t(std::size_t)>& key_of_row)
{
    std::vector<std::uint64_t> keys(count);
    parallel_for(count, 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row)
            keys[row] = key_of_row(row);
    });
    rows_.resize(count);
    std::iota(rows_.begin(), rows_.end(), std::size_t(0));
    std::stable_sort(rows_.begin(), rows_.end(), [&](std::size_t a, std::size_t b) { return keys[a] < keys[b]; });
}

} // namespace isospline
