#include "isospline/scene/packet_stream.h"
#include "isospline/scene/ray_caster_impl.h"
#include "isospline/scene/settling_gain.h"

#include <bit>

namespace isospline {

namespace {

/// The hits of a packet of several, from its first one on.
std::span<Hit> hits_of_packet(std::span<Hit> hits, std::size_t packet, int width)
{
    return hits.subspan(std::min(packet * static_cast<std::size_t>(width), hits.size()));
}

/// Sets the parts of a hit that are known before its object completes it.
void set_hit(Hit& hit, double t, const HitIds& ids, const MeshHits* in_meshes, std::uint32_t geometry_id)
{
    hit.t = t;
    hit.uv = glm::vec2(0.0f);
    hit.geometry_id = geometry_id;
    hit.primitive_id = ids.primitive;
    if (const MeshHit* const in_mesh = in_meshes != nullptr ? in_meshes->find(ids.slot) : nullptr)
        hit.uv = in_mesh->hit.uv;
}

} // namespace

LaneMask RayCaster::Impl::prepare_singles(const RayPacket& rays, std::size_t index, const Traversal& traversal)
{
    const LaneMask used = prepare_packet(rays, index, traversal.met.frame, prepared);
    if (const Instance* const alone = traversal.alone; alone != nullptr && used != 0)
        to_lattice(prepared, alone->placement.centred_to_local, alone->object->cell_shape(), local);
    return used;
}

Ray RayCaster::Impl::begin(const Traversal& traversal, const Ray& given, int lane)
{
    query.prepared = prepared[lane];
    query.alone = traversal.alone != nullptr ? &local : nullptr;
    query.lane_alone = lane;
    query.begin(given);
    if (traversal.alone == nullptr)
        return query.prepared.ray;
    query.instID[0] = traversal.slot; // as in a scene of instances
    return {local.origin_of(lane), local.direction_of(lane), local.t_near[lane], local.t_far[lane]};
}

LaneMask RayCaster::Impl::cast_singles(const RayPacket& rays, std::size_t index, std::span<Hit> hits)
{
    LaneMask hit_lanes = 0;
    RTCRayHit ray_hit;
    for (LaneMask rest = prepare_singles(rays, index, seen); rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const Ray given = rays.ray(lane);
        set_ray(begin(seen, given, lane), ray_hit);
        embree::intersect(seen.scene, query, ray_hit);
        query.rethrow();
        if (!query.has_hit())
            continue;
        hit_lanes |= LaneMask{1} << lane;
        Hit& hit = hits[static_cast<std::size_t>(lane)];
        const Instance& instance = *scene.instances[query.nearest_ids.slot];
        set_hit(hit, query.nearest_given, query.nearest_ids, &query.in_meshes, instance.id);
        if (complete)
            instance.object->complete(hit, given, query.nearest.gradient, instance.placement);
    }
    return hit_lanes;
}

void RayCaster::Impl::set_hits(const RayPacket& rays, LaneMask lanes, const PacketHits& found,
                               const MeshHits* in_meshes, std::span<Hit> hits) const
{
    while (lanes != 0) {
        const std::uint32_t slot = found.nearest_ids[std::countr_zero(lanes)].slot;
        const Instance& instance = *scene.instances[slot];
        LaneMask of_instance = 0;
        for (LaneMask rest = lanes; rest != 0; rest &= rest - 1u) {
            const int lane = std::countr_zero(rest);
            const HitIds& ids = found.nearest_ids[lane];
            if (ids.slot != slot)
                continue;
            of_instance |= LaneMask{1} << lane;
            set_hit(hits[static_cast<std::size_t>(lane)], found.nearest_given[lane], ids,
                    in_meshes != nullptr ? in_meshes + lane : nullptr, instance.id);
        }
        if (complete)
            instance.object->complete(hits, rays, found.nearest_given, of_instance, found.nearest, instance.placement);
        lanes &= ~of_instance;
    }
}

template <int Size>
LaneMask RayCaster::Impl::cast_packet(const RayPacket& rays, std::size_t index, std::span<Hit> hits)
{
    const LaneMask hit_lanes = find_hits<Size>(rays, index, seen);
    set_hits(rays, hit_lanes, *packet_query, packet_query->in_meshes, hits);
    return hit_lanes;
}

void RayCaster::Impl::cast_stream(std::span<const RayPacket> packets, std::size_t index, std::span<Hit> hits,
                                  std::span<LaneMask> hit_lanes)
{
    stream_hits.resize(std::max(stream_hits.size(), packets.size()));
    PacketStream(scene.instances, seen.met, packets, index, hit_lanes).cast(stream_hits);
    const bool has_others = seen.met.others != nullptr;
    for (std::size_t i = 0; i < packets.size(); ++i) {
        if (has_others)
            cast_at_others(packets[i], index, stream_hits[i], hit_lanes[i]);
        set_hits(packets[i], hit_lanes[i], stream_hits[i], has_others ? mesh_hits : nullptr,
                 hits_of_packet(hits, i, width()));
        index += static_cast<std::size_t>(packets[i].count);
    }
}

void RayCaster::Impl::cast_at_others(const RayPacket& rays, std::size_t index, PacketHits& hits, LaneMask& hit_lanes)
{
    RTCRayHit ray_hit;
    for (LaneMask rest = prepare_singles(rays, index, seen); rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const Ray given = rays.ray(lane);
        Ray ready = begin(seen, given, lane);
        query.begin_at(hits, lane);
        ready.t_far = std::min(ready.t_far, query.t_limit);
        set_ray(ready, ray_hit);
        embree::intersect(seen.met.others.get(), query, ray_hit);
        query.rethrow();
        std::swap(mesh_hits[lane], query.in_meshes);
        if (!query.has_hit())
            continue;
        hit_lanes |= LaneMask{1} << lane;
        hits.set(lane, query.nearest, query.nearest_given, query.nearest_ids);
    }
}

RayCaster::RayCaster(const SceneSnapshot& scene, Rays rays, Parts parts, Contact contact, bool SeenBy::*sees)
    : impl_(std::make_unique<Impl>(*scene.impl_, parts, sees))
{
    impl_->query.touches_meshes = contact == Contact::touch;
    if (rays == Rays::incoherent)
        return;
    impl_->packet_size = Device::shared().packet_size();
    impl_->packet_query.emplace(impl_->scene.instances);
}
RayCaster::~RayCaster() = default;

int RayCaster::width() const
{
    return impl_->width();
}

std::size_t RayCaster::batch_size() const
{
    return impl_->seen.met.streams.empty() && impl_->shadow.met.streams.empty() ? 1 : largest_batch;
}

LaneMask RayCaster::cast(const RayPacket& rays, std::size_t index, std::span<Hit> hits)
{
    LaneMask hit_lanes;
    cast({&rays, 1}, index, hits, {&hit_lanes, 1});
    return hit_lanes;
}

void RayCaster::cast(std::span<const RayPacket> packets, std::size_t index, std::span<Hit> hits,
                     std::span<LaneMask> hit_lanes)
{
    check_lanes("hit_lanes", packets, hit_lanes);
    for (std::size_t i = 0; i < packets.size(); ++i)
        check_packet(packets[i], width(), hits_of_packet(hits, i, width()).size());
    impl_->settling_gain += SettlingGain::of_rays(ray_count(packets), impl_->packet_size != 0);
    if (impl_->prefers_stream(impl_->seen, impl_->sees, packets))
        return impl_->cast_stream(packets, index, hits, hit_lanes);
    for (std::size_t i = 0; i < packets.size(); ++i) {
        hit_lanes[i] = impl_->packet_size == 0
                           ? impl_->cast_singles(packets[i], index, hits_of_packet(hits, i, width()))
                           : dispatch_packet_size(impl_->packet_size, [&](auto size) {
                                 return impl_->cast_packet<size>(packets[i], index, hits_of_packet(hits, i, width()));
                             });
        index += static_cast<std::size_t>(packets[i].count);
    }
}

void RayCaster::cast(std::span<const Ray> rays, std::span<Hit> hits)
{
    check_one_per_ray("hits", rays.size(), hits.size());
    LaneMask hit_lanes[largest_batch];
    for_each_batch(rays, width(), batch_size(), [&](std::span<const RayPacket> packets, std::size_t first) {
        cast(packets, first, hits.subspan(first), hit_lanes);
        for (std::size_t i = 0; i < packets.size(); ++i)
            for (int lane = 0; lane < packets[i].count; ++lane, ++first)
                if ((hit_lanes[i] >> lane & 1u) == 0)
                    hits[first].clear();
    });
}

void SceneSnapshot::cast_rays(std::span<const Ray> rays, std::span<Hit> hits, bool coherent, bool SeenBy::*sees) const
{
    RayCaster(*this, coherent ? RayCaster::Rays::coherent : RayCaster::Rays::incoherent, RayCaster::Parts::all,
              RayCaster::Contact::crossing, sees)
        .cast(rays, hits);
}

} // namespace isospline
