#include "isospline/scene/ray_query.h"

#include "isospline/math/affine.h"

#include <bit>
#include <optional>

namespace isospline {

LatticeRay* RayQuery::in_lattice(std::uint32_t slot, const std::vector<HalfSpace>& clip_lattice)
{
    if (slot != cached_slot) {
        cached_slot = slot;
        const glm::dmat4& world_to_lattice = instances[slot]->placement.centred_to_local;
        const Ray& ray = prepared.ray;
        cached_ray.set(transform_point(world_to_lattice, ray.origin), transform_vector(world_to_lattice, ray.direction),
                       0.0, ray.t_far);
        clip_leaves_any = true;
        if (!clip_lattice.empty()) {
            const std::optional<Interval> kept =
                clip({cached_ray.origin, cached_ray.direction, 0.0, ray.t_far}, clip_lattice);
            clip_leaves_any = kept.has_value();
            if (kept) {
                cached_ray.t_near = kept->t_near;
                cached_ray.t_far = kept->t_far;
            }
        }
    }
    return clip_leaves_any ? &cached_ray : nullptr;
}

void PacketQuery::enter(std::uint32_t slot, const std::vector<HalfSpace>& clip_lattice)
{
    if (slot == cached_slot)
        return;
    cached_slot = slot;
    to_lattice(prepared, instances[slot]->placement.centred_to_local, in_lattice);
    clip_leaves = used;
    if (clip_lattice.empty())
        return;
    for (LaneMask rest = used; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const std::optional<Interval> kept = clip(
            {in_lattice.origin_of(lane), in_lattice.direction_of(lane), 0.0, in_lattice.t_far[lane]}, clip_lattice);
        if (kept) {
            in_lattice.t_near[lane] = kept->t_near;
            in_lattice.t_far[lane] = kept->t_far;
        } else {
            clip_leaves &= ~(LaneMask{1} << lane);
        }
    }
}

} // namespace isospline
