#include "isospline/scene/packet_occlusion.h"

#include "isospline/scene/isosurface_object.h"

#include <bit>

namespace isospline {

void PacketOcclusion::set_occluded(LaneMask lanes)
{
    occluded |= lanes;
    for (LaneMask rest = lanes; rest != 0; rest &= rest - 1u)
        t_limit[std::countr_zero(rest)] = -huge_inverse;
}

bool PacketOcclusion::solve(const CandidateCells& cells)
{
    const LaneMask found = object_->intersector_.any_roots(cells, object_->surface_->threshold(), in_lattice);
    set_occluded(found);
    return found != 0;
}

void PacketOcclusion::enter(std::uint32_t slot, const IsosurfaceObject& entered)
{
    if (slot == cached_slot)
        return;
    finish(); // before the rays are those of another object
    const IsosurfaceSnapshot& surface = *entered.surface_;
    PacketQuery::enter(slot, surface);
    object_ = &entered;
    first_.lanes = 0;
    // The origin of a ray may be, within rounding, in a cell that a plane cuts away.
    if (!surface.planes().all().empty())
        return;
    entered.tracer_.add_first_cells(surface.volume(), in_lattice, used & ~occluded, first_, waiting_);
    for (LaneMask rest = surface.kept_cells().is_all() ? 0 : first_.lanes; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        if (!surface.kept_cells().contains(waiting_.lower_of(lane)))
            waiting_.lanes &= ~(LaneMask{1} << lane);
    }
    finish();
}

void PacketOcclusion::test(unsigned int primitive, LaneMask lanes)
{
    const auto solve_cells = [](void* context, const CandidateCells& cells) {
        return static_cast<PacketOcclusion*>(context)->solve(cells);
    };
    if (lanes != 0)
        object_->trace(primitive, in_lattice, lanes, {solve_cells, this, t_limit, &waiting_, &first_});
}

void PacketOcclusion::finish()
{
    if (waiting_.lanes != 0)
        solve(waiting_);
    waiting_.lanes = 0;
}

} // namespace isospline
