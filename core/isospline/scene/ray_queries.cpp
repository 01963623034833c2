#include "isospline/scene/ray_query.h"
#include "isospline/scene/scene_snapshot_impl.h"
#include "isospline/util/error.h"

#include <algorithm>
#include <bit>

namespace isospline {

void SceneSnapshot::Impl::cast_singles(std::span<const Ray> rays, std::span<Hit> hits) const
{
    RayQuery query(instances);
    RTCRayHit ray_hit;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        hits[i].clear();
        if (!prepare(rays[i], i, centre, centred_bounds, query.prepared))
            continue;
        query.begin();
        set_ray(query.prepared.ray, ray_hit.ray);
        ray_hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        ray_hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        embree::intersect(camera_top.get(), query, ray_hit);
        if (ray_hit.hit.geomID == RTC_INVALID_GEOMETRY_ID)
            continue;
        // The nearest root is kept in double precision; only a triangle can be nearer than that.
        const double t = std::min(query.nearest.t, static_cast<double>(ray_hit.ray.tfar));
        hits[i].t = query.prepared.original_t(t);
        const Instance& instance = *instances[ray_hit.hit.instID[0]];
        hits[i].geometry_id = instance.id;
        hits[i].primitive_id = ray_hit.hit.primID;
        hits[i].uv = {ray_hit.hit.u, ray_hit.hit.v};
        instance.object->complete(hits[i], rays[i], query.nearest.gradient, instance.placement);
    }
}

template <int Size>
void SceneSnapshot::Impl::cast_packets(std::span<const Ray> rays, std::span<Hit> hits) const
{
    PacketQuery query(instances);
    alignas(64) RTCRayHitNt<Size> packet;
    for (std::size_t first = 0; first < rays.size(); first += Size) {
        const std::size_t count = std::min<std::size_t>(Size, rays.size() - first);
        for (std::size_t i = first; i < first + count; ++i)
            hits[i].clear();
        const LaneMask used = prepare_packet(rays.subspan(first, count), first, centre, centred_bounds, query.prepared);
        if (used == 0)
            continue;
        query.begin(used);
        set_rays(query.prepared, packet);
        alignas(64) int valid[Size];
        for (int lane = 0; lane < Size; ++lane)
            valid[lane] = -static_cast<int>(used >> lane & 1u);
        embree::intersect_coherent(camera_top.get(), query, valid, packet);

        LaneMask unfinished = 0;
        for (LaneMask rest = used; rest != 0; rest &= rest - 1u) {
            const int lane = std::countr_zero(rest);
            if (packet.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID)
                continue;
            unfinished |= LaneMask{1} << lane;
            Hit& hit = hits[first + static_cast<std::size_t>(lane)];
            const double t = std::min(query.nearest.t[lane], static_cast<double>(packet.ray.tfar[lane]));
            hit.t = query.prepared.original_t(lane, t);
            hit.primitive_id = packet.hit.primID[lane];
            hit.uv = {packet.hit.u[lane], packet.hit.v[lane]};
        }
        while (unfinished != 0) {
            const unsigned int slot = packet.hit.instID[0][std::countr_zero(unfinished)];
            const Instance& instance = *instances[slot];
            LaneMask of_instance = 0;
            for (LaneMask rest = unfinished; rest != 0; rest &= rest - 1u) {
                const int lane = std::countr_zero(rest);
                if (packet.hit.instID[0][lane] != slot)
                    continue;
                of_instance |= LaneMask{1} << lane;
                hits[first + static_cast<std::size_t>(lane)].geometry_id = instance.id;
            }
            instance.object->complete(hits.subspan(first, count), rays.subspan(first, count), of_instance,
                                      query.nearest, instance.placement);
            unfinished &= ~of_instance;
        }
    }
}

void SceneSnapshot::cast_rays(std::span<const Ray> rays, std::span<Hit> hits, bool coherent) const
{
    ISOSPLINE_ASSERT(rays.size(), ==, hits.size());
    if (!coherent)
        return impl_->cast_singles(rays, hits);
    switch (Device::shared().packet_size()) {
    case 16:
        return impl_->cast_packets<16>(rays, hits);
    case 8:
        return impl_->cast_packets<8>(rays, hits);
    default:
        return impl_->cast_packets<4>(rays, hits);
    }
}

void SceneSnapshot::test_occlusions(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const
{
    ISOSPLINE_ASSERT(rays.size(), ==, occluded.size());
    RayQuery query(impl_->instances);
    RTCRay ray;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        occluded[i] = 0;
        if (!prepare(rays[i], i, impl_->centre, impl_->centred_bounds, query.prepared))
            continue;
        query.begin();
        set_ray(query.prepared.ray, ray);
        embree::occluded(impl_->shadow_top(), query, ray);
        occluded[i] = ray.tfar < 0.0f;
    }
}

} // namespace isospline
