#include "isospline/scene/ray_caster_impl.h"

#include <bit>

namespace isospline {

namespace {

/// Sets the parts of a hit that are known before its object completes it.
void set_hit(Hit& hit, double t, const HitIds& ids, const MeshHits& in_meshes, std::uint32_t geometry_id)
{
    hit.clear();
    hit.t = t;
    hit.geometry_id = geometry_id;
    hit.primitive_id = ids.primitive;
    if (const MeshHit* const in_mesh = in_meshes.find(ids.slot))
        hit.uv = in_mesh->hit.uv;
}

} // namespace

LaneMask RayCaster::Impl::prepare_singles(const RayPacket& rays, std::size_t index, const Traversal& traversal)
{
    const LaneMask used = prepare_packet(rays, index, scene.frame, prepared);
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
    for (LaneMask rest = prepare_singles(rays, index, camera); rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const Ray given = rays.ray(lane);
        set_ray(begin(camera, given, lane), ray_hit);
        embree::intersect(camera.scene, query, ray_hit);
        query.rethrow();
        if (!query.has_hit())
            continue;
        hit_lanes |= LaneMask{1} << lane;
        Hit& hit = hits[static_cast<std::size_t>(lane)];
        const Instance& instance = *scene.instances[query.nearest_ids.slot];
        set_hit(hit, query.nearest_given, query.nearest_ids, query.in_meshes, instance.id);
        if (complete)
            instance.object->complete(hit, given, query.nearest.gradient, instance.placement);
    }
    return hit_lanes;
}

template <int Size>
LaneMask RayCaster::Impl::cast_packet(const RayPacket& rays, std::size_t index, std::span<Hit> hits)
{
    const LaneMask hit_lanes = find_hits<Size>(rays, index, camera);
    const PacketQuery& packet = *packet_query;
    alignas(64) double t[PreparedPacket::capacity] = {};
    for (LaneMask rest = hit_lanes; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        Hit& hit = hits[static_cast<std::size_t>(lane)];
        set_hit(hit, packet.nearest_given[lane], packet.nearest_ids[lane], packet.in_meshes[lane],
                scene.instances[packet.nearest_ids[lane].slot]->id);
        t[lane] = hit.t;
    }
    for (LaneMask rest = complete ? hit_lanes : 0; rest != 0;) {
        const unsigned int slot = packet.nearest_ids[std::countr_zero(rest)].slot;
        LaneMask of_instance = 0;
        for (LaneMask others = rest; others != 0; others &= others - 1u)
            if (const int lane = std::countr_zero(others); packet.nearest_ids[lane].slot == slot)
                of_instance |= LaneMask{1} << lane;
        const Instance& instance = *scene.instances[slot];
        instance.object->complete(hits, rays, t, of_instance, packet.nearest, instance.placement);
        rest &= ~of_instance;
    }
    return hit_lanes;
}

RayCaster::RayCaster(const SceneSnapshot& scene, Rays rays, Parts parts, Contact contact)
    : impl_(std::make_unique<Impl>(*scene.impl_, parts))
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
    return impl_->packet_size == 0 ? RayPacket::capacity : impl_->packet_size;
}

LaneMask RayCaster::cast(const RayPacket& rays, std::size_t index, std::span<Hit> hits)
{
    check_packet(rays, width(), hits.size());
    impl_->ray_count += static_cast<unsigned int>(rays.count);
    if (impl_->packet_size == 0)
        return impl_->cast_singles(rays, index, hits);
    return dispatch_packet_size(impl_->packet_size,
                                [&](auto size) { return impl_->cast_packet<size>(rays, index, hits); });
}

void RayCaster::cast(std::span<const Ray> rays, std::span<Hit> hits)
{
    check_one_per_ray("hits", rays.size(), hits.size());
    for_each_packet(rays, width(), [&](const RayPacket& packet, std::size_t first) {
        const std::span<Hit> of_packet = hits.subspan(first, static_cast<std::size_t>(packet.count));
        const LaneMask hit_lanes = cast(packet, first, of_packet);
        for (std::size_t lane = 0; lane < of_packet.size(); ++lane)
            if ((hit_lanes >> lane & 1u) == 0)
                of_packet[lane].clear();
    });
}

void SceneSnapshot::cast_rays(std::span<const Ray> rays, std::span<Hit> hits, bool coherent) const
{
    RayCaster(*this, coherent ? RayCaster::Rays::coherent : RayCaster::Rays::incoherent).cast(rays, hits);
}

} // namespace isospline
