#include "isospline/scene/ray_query.h"

#include "isospline/cell/packet_clip.h"

#include <algorithm>
#include <bit>
#include <optional>

namespace isospline {

void RayQuery::enter(std::uint32_t slot, const IsosurfaceSnapshot& surface, const CapBoxes& caps)
{
    if (slot == cached_slot)
        return;
    cached_slot = slot;
    in_lattice = alone != nullptr
                     ? alone->ray(lane_alone)
                     : to_lattice(prepared, instances[slot]->placement.centred_to_local, surface.volume().cell_shape());
    clip_leaves_any = true;
    enters_cap = needs_caps = false;
    const SolidPlanes& planes = surface.planes();
    if (planes.all().empty())
        return;
    const std::optional<Chord> kept =
        clip({in_lattice.origin, in_lattice.direction, in_lattice.t_near, in_lattice.t_far}, planes.all());
    clip_leaves_any = kept.has_value();
    if (!kept)
        return;
    in_lattice.t_near = kept->t_near;
    in_lattice.t_far = kept->t_far;
    if (caps.boxes.empty())
        return;
    chord = CappedChord(*kept, in_lattice.origin, in_lattice.direction, in_lattice.limits, caps);
    needs_caps = true;
    if (all == nullptr)
        enters_cap = chord.enters_cap(surface);
    else
        add_chord({chord, &surface, slot}, chords);
}

void PacketQuery::enter_mesh(std::uint32_t slot)
{
    if (slot == slot_in_mesh)
        return;
    slot_in_mesh = slot;
    for (LaneMask rest = used; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        in_mesh.set(lane, ray_in_mesh(given->ray(lane), instances[slot]->placement));
    }
}

void PacketQuery::enter(std::uint32_t slot, const IsosurfaceSnapshot& surface, const CapBoxes& caps)
{
    if (slot == cached_slot)
        return;
    cached_slot = slot;
    if (slot != slot_in_lattice)
        to_lattice(prepared, instances[slot]->placement.centred_to_local, surface.volume().cell_shape(), in_lattice);
    clip_leaves = used;
    enters_cap = needs_caps = 0;
    const SolidPlanes& planes = surface.planes();
    if (planes.all().empty())
        return;
    PlanesOfChords through;
    clip_leaves = clip(in_lattice, used, planes.all(), through);
    if (caps.boxes.empty())
        return;
    needs_caps = clip_leaves;
    for (LaneMask rest = clip_leaves; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const Chord kept{
            {in_lattice.t_near[lane], in_lattice.t_far[lane]}, through.entry_of(lane), through.exit_of(lane)};
        chords[lane] =
            CappedChord(kept, in_lattice.origin_of(lane), in_lattice.direction_of(lane), in_lattice.limits[lane], caps);
        enters_cap |= static_cast<LaneMask>(chords[lane].enters_cap(surface)) << lane;
    }
}

} // namespace isospline
