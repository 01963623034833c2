#include "isospline/scene/ray_query.h"
#include "isospline/scene/scene_snapshot_impl.h"
#include "isospline/util/error.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace isospline {

namespace {

/// Sets what is known of a hit before its object completes it: of a mesh, t is that of its triangle.
void set_hit(Hit& hit, double t, const HitIds& ids, const MeshHit& nearest_in_mesh)
{
    hit.t = t;
    hit.primitive_id = ids.primitive;
    if (ids.slot != nearest_in_mesh.slot)
        return;
    hit.t = nearest_in_mesh.hit.t;
    hit.uv = nearest_in_mesh.hit.uv;
}

} // namespace

void SceneSnapshot::Impl::cast_singles(std::span<const Ray> rays, std::span<Hit> hits) const
{
    RayQuery query(instances);
    RTCRayHit ray_hit;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        hits[i].clear();
        if (!prepare(rays[i], i, frame, query.prepared))
            continue;
        query.begin(rays[i]);
        set_ray(query.prepared.ray, ray_hit.ray);
        embree::intersect(camera_top.get(), query, ray_hit);
        query.rethrow();
        if (!query.has_hit())
            continue;
        set_hit(hits[i], query.prepared.limits.given_t(query.nearest.t), query.nearest_ids, query.nearest_in_mesh);
        const Instance& instance = *instances[query.nearest_ids.slot];
        hits[i].geometry_id = instance.id;
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
        const LaneMask used = prepare_packet(rays.subspan(first, count), first, frame, query.prepared);
        if (used == 0)
            continue;
        query.begin(rays.subspan(first, count), used);
        set_rays(query.prepared, packet);
        alignas(64) int valid[Size];
        for (int lane = 0; lane < Size; ++lane)
            valid[lane] = -static_cast<int>(used >> lane & 1u);
        embree::intersect_coherent(camera_top.get(), query, valid, packet);
        query.rethrow();

        LaneMask unfinished = 0;
        for (LaneMask rest = used; rest != 0; rest &= rest - 1u) {
            const int lane = std::countr_zero(rest);
            if (!query.has_hit(lane))
                continue;
            unfinished |= LaneMask{1} << lane;
            Hit& hit = hits[first + static_cast<std::size_t>(lane)];
            set_hit(hit, query.prepared.limits[lane].given_t(query.nearest.t[lane]), query.nearest_ids[lane],
                    query.nearest_in_mesh[lane]);
        }
        while (unfinished != 0) {
            const unsigned int slot = query.nearest_ids[std::countr_zero(unfinished)].slot;
            const Instance& instance = *instances[slot];
            LaneMask of_instance = 0;
            for (LaneMask rest = unfinished; rest != 0; rest &= rest - 1u) {
                const int lane = std::countr_zero(rest);
                if (query.nearest_ids[lane].slot != slot)
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
        if (!prepare(rays[i], i, impl_->frame, query.prepared))
            continue;
        query.begin(rays[i]);
        set_ray(query.prepared.ray, ray);
        embree::occluded(impl_->shadow_top(), query, ray);
        query.rethrow();
        occluded[i] = ray.tfar < 0.0f;
    }
}

} // namespace isospline
