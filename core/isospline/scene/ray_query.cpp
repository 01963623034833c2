#include "isospline/scene/ray_query.h"

#include "isospline/math/affine.h"

namespace isospline {

std::optional<LatticeRay>& RayQuery::in_lattice(std::uint32_t instance, const glm::dmat4& world_to_lattice,
                                                const std::vector<HalfSpace>& clip_lattice)
{
    if (instance == cached_instance)
        return cached_ray;
    cached_instance = instance;
    cached_ray.reset();

    Ray ray = world_ray;
    ray.origin = transform_point(world_to_lattice, world_ray.origin);
    ray.direction = transform_vector(world_to_lattice, world_ray.direction);
    if (const std::optional<Interval> kept = clip(ray, clip_lattice)) {
        ray.t_near = kept->t_near;
        ray.t_far = kept->t_far;
        cached_ray.emplace(ray);
    }
    return cached_ray;
}

} // namespace isospline
