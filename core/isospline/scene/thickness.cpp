#include "isospline/scene/thickness.h"

#include "isospline/query/closest_point.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace isospline {

namespace {

/// The radius of the largest ball that touches the surface at a point from inside. `radius` is that of a ball that
/// contains it.
double shrunk_ball(ClosestPointFinder& find, const ClosestPoint& at, double radius)
{
    constexpr int most_balls = 64;
    for (int ball = 0; ball < most_balls; ++ball) {
        const glm::dvec3 center = at.position - radius * at.normal;
        const ClosestPoint other = find.within(center, radius);
        const double margin = 1e-7 * radius + other.error;
        if (!(other.distance < radius - margin))
            break;
        // The ball through both points whose centre is on the normal.
        const glm::dvec3 between = at.position - other.position;
        const double along = glm::dot(between, at.normal);
        const double next = glm::dot(between, between) / (2.0 * along);
        if (!(next > 0.0 && next < radius))
            break;
        radius = next;
    }
    return radius;
}

} // namespace

void find_thickness(const SceneSnapshot& scene, const IsosurfaceSnapshot& surface, ThicknessMethod method,
                    std::span<const glm::dvec3> points_world, std::span<double> thickness)
{
    // Rays from the surface inwards.
    ClosestPointFinder find(surface);
    std::vector<ClosestPoint> starts(points_world.size());
    std::vector<Ray> rays(points_world.size());
    std::vector<Hit> hits(points_world.size());
    for (std::size_t i = 0; i < points_world.size(); ++i) {
        starts[i] = find(points_world[i]);
        rays[i].origin = glm::dvec3(0.0);
        rays[i].direction = glm::dvec3(0.0, 0.0, 1.0);
        rays[i].t_far = -1.0; // meets nothing
        if (!(glm::length(starts[i].normal) > 0.0))
            continue;
        Hit start;
        start.position = starts[i].position;
        start.normal = starts[i].normal;
        start.geometry_id = 0;
        start.primitive_id = starts[i].primitive_id;
        rays[i] = Ray{};
        rays[i].direction = -starts[i].normal;
        rays[i].origin = scene.offset_position(start, rays[i].direction);
    }
    scene.cast_rays(rays, hits);
    const double largest = glm::length(scene.bounds().size());
    for (std::size_t i = 0; i < points_world.size(); ++i) {
        const bool is_known = glm::length(starts[i].normal) > 0.0;
        thickness[i] = is_known && std::isfinite(hits[i].t)
                           ? hits[i].t + glm::length(rays[i].origin - starts[i].position)
                       : is_known ? std::numeric_limits<double>::infinity()
                                  : std::numeric_limits<double>::quiet_NaN();
        if (method == ThicknessMethod::ray || !is_known)
            continue;
        const double first = std::min(0.5 * thickness[i], largest), last = shrunk_ball(find, starts[i], first);
        if (last < first || std::isfinite(thickness[i]))
            thickness[i] = 2.0 * last;
    }
}

} // namespace isospline
