#include "isospline/scene/thickness.h"

#include "isospline/query/inscribed_ball.h"
#include "isospline/query/lattice_metric.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace isospline {

void find_thickness(const SceneSnapshot& scene, const IsosurfaceSnapshot& surface, ThicknessMethod method,
                    double ripple, std::span<const glm::dvec3> points_world, std::span<double> thickness)
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
    const auto is_known = [&](std::size_t i) { return glm::length(starts[i].normal) > 0.0; };
    for (std::size_t i = 0; i < points_world.size(); ++i) {
        if (!is_known(i))
            thickness[i] = std::numeric_limits<double>::quiet_NaN();
        else if (std::isfinite(hits[i].t))
            thickness[i] = hits[i].t + glm::length(rays[i].origin - starts[i].position);
        else
            thickness[i] = std::numeric_limits<double>::infinity();
    }
    if (method == ThicknessMethod::ray)
        return;

    const Box bounds = scene.bounds();
    const double largest = glm::length(bounds.size());
    const double edge = LatticeMetric(surface.volume().lattice_to_world()).shortest_edge;
    const double precision = std::clamp(0.02 * ripple, 1e-3 * edge, 1e-2 * edge);
    ClosestPointFinder find_within_precision(surface, {.tolerance = precision});
    for (std::size_t i = 0; i < points_world.size(); ++i) {
        if (!is_known(i))
            continue;
        const double ray = std::min(thickness[i], 2.0 * largest);
        const Ball ball = inscribed_ball(find_within_precision, starts[i], 0.5 * (ray + std::min(ripple, 0.5 * ray)),
                                         ripple, precision, bounds);
        if (std::isfinite(thickness[i]) || ball.radius < largest - ripple)
            thickness[i] = 2.0 * ball.radius;
    }
}

} // namespace isospline
