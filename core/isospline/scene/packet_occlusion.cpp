#include "isospline/scene/packet_occlusion.h"

#include "isospline/scene/isosurface_object.h"

#include <algorithm>
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
    const CellIntersector& intersector = object_->intersector_;
    const IsosurfaceSnapshot& surface = *object_->surface_;
    if (!needs_each()) {
        const LaneMask found = intersector.any_roots(cells, surface.threshold(), in_lattice);
        set_occluded(found);
        return found != 0;
    }
    const LaneMask before = occluded;
    struct Visit {
        PacketOcclusion& query;
        const CandidateCells& cells;

        std::uint64_t primitive(int lane) const
        {
            return query.object_->surface_->volume().primitive_id(cells.lower_of(lane));
        }
    } visit{*this, cells};
    if (all != nullptr) {
        const auto list = [](void* context, int lane, const CrossingInCell& crossing, double t_begin) {
            const Visit& of = *static_cast<Visit*>(context);
            of.query.list(lane, {crossing, t_begin, of.query.cached_slot, of.primitive(lane)});
        };
        intersector.visit_roots(cells, surface.threshold(), in_lattice, {list, &visit});
        return std::exchange(has_lowered_, false);
    }
    if (const std::optional<Absorption::Depth>& each = absorption->depth(cached_slot)) {
        std::uint8_t counts[packet_capacity];
        const LaneMask found = intersector.count_roots(cells, surface.threshold(), in_lattice, counts);
        for (LaneMask rest = found; rest != 0; rest &= rest - 1u) {
            const int lane = std::countr_zero(rest);
            absorb(lane, counts[lane] * *each);
        }
    } else {
        const auto cross = [](void* context, int lane, const CrossingInCell& crossing, double) {
            const Visit& of = *static_cast<Visit*>(context);
            of.query.cross(lane, of.query.cached_slot, of.query.prepared.limits[lane].given_t(crossing.root.t),
                           of.primitive(lane), crossing.root.gradient);
        };
        intersector.visit_roots(cells, surface.threshold(), in_lattice, {cross, &visit});
    }
    return occluded != before;
}

void PacketOcclusion::absorb(int lane, Absorption::Depth added)
{
    if (depths.add(lane, added))
        set_occluded(LaneMask{1} << lane);
}

void PacketOcclusion::cross(int lane, std::uint32_t slot, double t_given, std::uint64_t primitive,
                            const glm::dvec3& gradient_local)
{
    if (absorption == nullptr)
        return set_occluded(LaneMask{1} << lane);
    if (const std::optional<Absorption::Depth>& each = absorption->depth(slot))
        return absorb(lane, *each);
    const Instance& instance = *instances[slot];
    const Ray ray = given->ray(lane);
    Hit hit;
    hit.clear();
    hit.t = t_given;
    hit.geometry_id = instance.id;
    hit.primitive_id = primitive;
    instance.object->complete(hit, ray, gradient_local, instance.placement);
    absorb(lane, absorption->depth(hit, ray));
}

void PacketOcclusion::cross(int lane, std::uint32_t slot, std::uint32_t primitive, const TriangleHit& hit)
{
    if (all != nullptr)
        list(lane, {hit, hit.t, slot, primitive});
    else
        cross(lane, slot, hit.t, primitive);
}

void PacketOcclusion::list(int lane, const RawCrossing& crossing)
{
    std::vector<RawCrossing>& listed = all->of_ray[lane];
    if (absorption == nullptr)
        listed.push_back(crossing);
    else if (add_visible(crossing, *absorption, prepared.limits[lane], lane, depths, listed, t_limit[lane]))
        has_lowered_ = true;
}

void PacketOcclusion::end_rays(LaneMask lanes, float* t_far) const
{
    for (LaneMask rest = lanes; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        t_far[lane] = std::min(t_far[lane], rounded_up(t_limit[lane]));
    }
}

LaneMask PacketOcclusion::without_caps(std::uint32_t slot, LaneMask lanes)
{
    const auto found = std::find_if(capped_.begin(), capped_.end(), [&](const auto& of) { return of.first == slot; });
    LaneMask& known = found != capped_.end() ? found->second : capped_.emplace_back(slot, LaneMask{0}).second;
    return lanes & ~std::exchange(known, known | lanes);
}

void PacketOcclusion::enter(std::uint32_t slot, const IsosurfaceObject& entered)
{
    if (slot == cached_slot)
        return;
    finish(); // before the rays are those of another object
    const IsosurfaceSnapshot& surface = *entered.surface_;
    PacketQuery::enter(slot, surface, entered.caps_);
    object_ = &entered;
    first_.lanes = 0;
    // An instance may be entered again; its crossings count once.
    if (needs_each())
        return list_chords();
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

void PacketOcclusion::list_chords()
{
    const IsosurfaceSnapshot& surface = *object_->surface_;
    for (LaneMask rest = all != nullptr ? needs_caps : 0; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        add_chord({chords[lane], &surface, cached_slot}, all->chords_of_ray[lane]);
    }
}

void PacketOcclusion::test(unsigned int primitive, LaneMask lanes)
{
    const auto solve_cells = [](void* context, const CandidateCells& cells) {
        return static_cast<PacketOcclusion*>(context)->solve(cells);
    };
    if (lanes == 0)
        return;
    // A brick that may be dropped keeps its coefficients only while the rays are in it.
    CandidateCells* const waiting = object_->surface_->bricks().budget() == nullptr ? &waiting_ : nullptr;
    object_->trace(primitive, in_lattice, lanes, {solve_cells, this, t_limit, waiting, &first_});
}

void PacketOcclusion::finish()
{
    if (waiting_.lanes != 0)
        solve(waiting_);
    waiting_.lanes = 0;
}

} // namespace isospline
