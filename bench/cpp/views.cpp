#include "views.h"

#include "embree_triangles.h"
#include "subjects.h"

#include "isospline/math/random.h"
#include "isospline/render/projection.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace isospline::bench {

namespace {

constexpr int tile = 4; ///< pixels; a tile of 4 x 4 is a packet of 16

/// Rays through the centres of the pixels, tile after tile.
std::vector<Ray> primary_rays(const PerspectiveCamera& camera, glm::ivec2 size)
{
    if (size.x % tile != 0 || size.y % tile != 0)
        throw std::invalid_argument("size: expected multiples of 4");
    const Projection projection(camera, size);
    std::vector<Ray> rays;
    for (int top = 0; top < size.y; top += tile)
        for (int left = 0; left < size.x; left += tile)
            for (int y = top; y < top + tile; ++y)
                for (int x = left; x < left + tile; ++x)
                    rays.push_back(projection.ray({x + 0.5, y + 0.5}));
    return rays;
}

std::vector<SurfaceHit> isosurface_hits()
{
    std::vector<SurfaceHit> hits;
    for (const Hit& hit : hits_of(Rays::whole))
        hits.push_back({hit.t, hit.normal});
    return hits;
}

std::vector<SurfaceHit> mesh_hits()
{
    std::vector<TriangleHit> found(rays_of(Rays::whole).size());
    triangle_scene().cast_singles(rays_of(Rays::whole), found);
    std::vector<SurfaceHit> hits;
    hits.reserve(found.size());
    for (const TriangleHit& hit : found)
        hits.push_back({hit.t, hit.normal});
    return hits;
}

std::vector<Ray> make_rays(Rays kind)
{
    if (kind == Rays::whole || kind == Rays::close)
        return primary_rays(kind == Rays::whole ? subject().whole : subject().close, subject().size);
    const glm::dvec3 spacing = subject().volume->options().spacing;
    return ambient_rays(rays_of(Rays::whole), kind == Rays::ambient ? isosurface_hits() : mesh_hits(),
                        subject().ambient_count, 0.01 * std::min({spacing.x, spacing.y, spacing.z}));
}

} // namespace

const std::vector<Ray>& rays_of(Rays kind)
{
    static std::vector<Ray> made[4];
    auto& rays = made[static_cast<int>(kind)];
    if (rays.empty())
        rays = make_rays(kind);
    return rays;
}

const std::vector<Hit>& hits_of(Rays kind)
{
    static std::vector<Hit> found[4];
    auto& hits = found[static_cast<int>(kind)];
    if (hits.empty()) {
        hits.resize(rays_of(kind).size());
        spline_scene().cast_rays(rays_of(kind), hits);
    }
    return hits;
}

std::vector<Ray> ambient_rays(std::span<const Ray> rays, std::span<const SurfaceHit> hits, std::size_t count,
                              double offset)
{
    std::vector<std::size_t> hit;
    for (std::size_t i = 0; i < hits.size(); ++i)
        if (std::isfinite(hits[i].t))
            hit.push_back(i);
    if (hit.empty())
        throw std::runtime_error("subject: expected a surface that the whole view sees");
    std::vector<Ray> made;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t from = hit[i * hit.size() / count];
        const glm::dvec3 normal =
            glm::dot(hits[from].normal, rays[from].direction) > 0.0 ? -hits[from].normal : hits[from].normal;
        RandomSequence random({static_cast<int>(i), 0}, 0);
        const double height = 2.0 * random.next() - 1.0, azimuth = 2.0 * std::numbers::pi * random.next();
        const double radius = std::sqrt(1.0 - height * height);
        const glm::dvec3 on_sphere(radius * std::cos(azimuth), radius * std::sin(azimuth), height);
        made.push_back({rays[from].at(hits[from].t) + offset * normal, glm::normalize(normal + on_sphere)});
    }
    return made;
}

} // namespace isospline::bench
