// Rays at the caps of an isosurface. What is behind a cap that a ray comes in through is not looked at; a cap that it
// goes out through is the first hit only if no root is, and gives way to one at the same t.
#include "isospline/scene/isosurface_object.h"
#include "isospline/scene/ray_query.h"

#include <algorithm>
#include <bit>

namespace isospline {

namespace {

/// Whether a cap of an instance takes the place of the hit so far, which is not nearer. Where caps of several instances
/// coincide, as those of skin and bone in one clip do, the last one added is seen, in whatever order they are found.
bool takes_place(double t, double nearest_t, const Instances& instances, std::uint32_t slot, unsigned int hit_geometry,
                 unsigned int hit_slot)
{
    return t < nearest_t || hit_geometry == RTC_INVALID_GEOMETRY_ID || instances[hit_slot]->id < instances[slot]->id;
}

} // namespace

std::optional<IsosurfaceObject::CapHit> IsosurfaceObject::first_cap(const CappedChord& chord, bool enters_cap,
                                                                    double t_limit) const
{
    const double t = enters_cap ? chord.t_near : chord.t_far;
    const int face = enters_cap ? chord.entry : chord.exit;
    if (!(t <= t_limit) || !(enters_cap || chord.leaves_cap(*surface_)))
        return std::nullopt;
    const auto primitive = static_cast<std::uint32_t>(surface_->shell().count()) + static_cast<std::uint32_t>(face);
    return CapHit{{t, gradient_lattice(*surface_, chord.at(t))}, primitive};
}

void IsosurfaceObject::intersect_caps(const RTCIntersectFunctionNArguments& arguments, RayQuery& query) const
{
    auto& [ray, hit] = *reinterpret_cast<RTCRayHit*>(arguments.rayhit);
    const std::uint32_t slot = query.instID[0];
    const double t_limit = std::min(query.nearest.t, static_cast<double>(ray.tfar));
    const std::optional<CapHit> cap = first_cap(query.chord, query.enters_cap, t_limit);
    if (!cap || !takes_place(cap->root.t, query.nearest.t, query.instances, slot, hit.geomID, hit.instID[0]))
        return;
    query.nearest = cap->root;
    ray.tfar = rounded_up(cap->root.t);
    hit.Ng_x = hit.Ng_y = hit.Ng_z = 0.0f;
    hit.u = hit.v = 0.0f;
    hit.geomID = 0;
    hit.primID = cap->primitive;
    hit.instID[0] = slot;
}

void IsosurfaceObject::intersect_caps(const RTCIntersectFunctionNArguments& arguments, PacketQuery& query,
                                      LaneMask active) const
{
    const unsigned int size = arguments.N;
    RTCRayN* const rays = RTCRayHitN_RayN(arguments.rayhit, size);
    RTCHitN* const hits = RTCRayHitN_HitN(arguments.rayhit, size);
    const std::uint32_t slot = query.instID[0];
    for (LaneMask rest = active; rest != 0; rest &= rest - 1u) {
        const auto lane = static_cast<unsigned int>(std::countr_zero(rest));
        float& t_far = RTCRayN_tfar(rays, size, lane);
        const double t_limit = std::min(query.nearest.t[lane], static_cast<double>(t_far));
        const bool enters_cap = (query.enters_cap >> lane & 1u) != 0;
        const std::optional<CapHit> cap = first_cap(query.chords[lane], enters_cap, t_limit);
        if (!cap || !takes_place(cap->root.t, query.nearest.t[lane], query.instances, slot,
                                 RTCHitN_geomID(hits, size, lane), RTCHitN_instID(hits, size, lane, 0)))
            continue;
        query.nearest.set(static_cast<int>(lane), cap->root);
        t_far = rounded_up(cap->root.t);
        RTCHitN_u(hits, size, lane) = RTCHitN_v(hits, size, lane) = 0.0f;
        RTCHitN_geomID(hits, size, lane) = 0;
        RTCHitN_primID(hits, size, lane) = cap->primitive;
        RTCHitN_instID(hits, size, lane, 0) = slot;
    }
}

} // namespace isospline
