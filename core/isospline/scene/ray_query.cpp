#include "isospline/scene/ray_query.h"

#include "isospline/math/affine.h"

#include <algorithm>
#include <bit>
#include <optional>

namespace isospline {

void RayQuery::enter(std::uint32_t slot, const IsosurfaceSnapshot& surface)
{
    if (slot == cached_slot)
        return;
    cached_slot = slot;
    const glm::dmat4& world_to_lattice = instances[slot]->placement.centred_to_local;
    const Ray& ray = prepared.ray;
    in_lattice.set(transform_point(world_to_lattice, ray.origin), transform_vector(world_to_lattice, ray.direction),
                   0.0, ray.t_far);
    clip_leaves_any = true;
    enters_cap = false;
    const std::vector<HalfSpace>& clip_lattice = surface.clip_lattice();
    if (clip_lattice.empty())
        return;
    const std::optional<Chord> kept = clip({in_lattice.origin, in_lattice.direction, 0.0, ray.t_far}, clip_lattice);
    clip_leaves_any = kept.has_value();
    if (!kept)
        return;
    in_lattice.t_near = kept->t_near;
    in_lattice.t_far = kept->t_far;
    if (!surface.options().capped)
        return;
    chord = {*kept, in_lattice.origin, in_lattice.direction};
    const auto is_this = [&](const ChordOfInstance& listed) { return listed.slot == slot; };
    if (all == nullptr)
        enters_cap = chord.enters_cap(surface);
    else if (std::none_of(chords.begin(), chords.end(), is_this))
        chords.push_back({chord, &surface, slot});
}

void PacketQuery::enter(std::uint32_t slot, const IsosurfaceSnapshot& surface)
{
    if (slot == cached_slot)
        return;
    cached_slot = slot;
    to_lattice(prepared, instances[slot]->placement.centred_to_local, in_lattice);
    clip_leaves = used;
    enters_cap = 0;
    const std::vector<HalfSpace>& clip_lattice = surface.clip_lattice();
    if (clip_lattice.empty())
        return;
    for (LaneMask rest = used; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const glm::dvec3 origin = in_lattice.origin_of(lane), direction = in_lattice.direction_of(lane);
        const std::optional<Chord> kept = clip({origin, direction, 0.0, in_lattice.t_far[lane]}, clip_lattice);
        if (!kept) {
            clip_leaves &= ~(LaneMask{1} << lane);
            continue;
        }
        in_lattice.t_near[lane] = kept->t_near;
        in_lattice.t_far[lane] = kept->t_far;
        if (!surface.options().capped)
            continue;
        chords[lane] = {*kept, origin, direction};
        enters_cap |= static_cast<LaneMask>(chords[lane].enters_cap(surface)) << lane;
    }
}

} // namespace isospline
