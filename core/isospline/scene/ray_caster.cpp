#include "isospline/scene/ray_caster.h"

#include "isospline/scene/packet_occlusion.h"
#include "isospline/scene/scene_snapshot_impl.h"
#include "isospline/util/check.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

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

/// Throws std::invalid_argument unless a packet has at most `width` rays, and a hit for each of them.
void check_packet(const RayPacket& rays, int width, std::size_t hits)
{
    if (rays.count < 0 || rays.count > width)
        throw_invalid("rays", "a packet of at most " + std::to_string(width) + " rays", rays.count);
    if (static_cast<std::size_t>(rays.count) > hits)
        throw_invalid("hits", "one for each of " + std::to_string(rays.count) + " rays", hits);
}

/// Flags of lanes for Embree.
template <int Size>
struct ValidLanes {
    explicit ValidLanes(LaneMask lanes)
    {
        for (int lane = 0; lane < Size; ++lane)
            flags[lane] = -static_cast<int>(lanes >> lane & 1u);
    }
    alignas(64) int flags[Size];
};

/// Calls `body(packet, first)` for packets of up to `width` rays.
template <typename Body>
void for_each_packet(std::span<const Ray> rays, int width, const Body& body)
{
    RayPacket packet;
    for (std::size_t first = 0; first < rays.size(); first += static_cast<std::size_t>(packet.count)) {
        packet.count = static_cast<int>(std::min(static_cast<std::size_t>(width), rays.size() - first));
        for (int lane = 0; lane < packet.count; ++lane)
            packet.set(lane, rays[first + static_cast<std::size_t>(lane)]);
        body(packet, first);
    }
}

} // namespace

struct RayCaster::Impl {
    Impl(const SceneSnapshot::Impl& given_scene, Parts given_parts)
        : scene(given_scene), camera(scene.camera_traversal()), shadow(scene.shadow_traversal()),
          complete(given_parts == Parts::all), query(scene.instances)
    {
    }
    ~Impl() { scene.ray_count.fetch_add(ray_count, std::memory_order_relaxed); }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    /// Begins the query of a prepared ray, and returns the ray for Embree.
    Ray begin(const Traversal& traversal, const Ray& given, int lane);
    /// Prepares rays that are traced one by one; returns those that do not miss the scene's box.
    LaneMask prepare_singles(const RayPacket& rays, std::size_t index, const Traversal& traversal);
    LaneMask cast_singles(const RayPacket& rays, std::size_t index, std::span<Hit> hits);
    /// Begins the query of a packet, and sets Embree's rays; returns the rays that do not miss the scene's box.
    template <int Size, class Packet, class EmbreeRays>
    LaneMask begin(const Traversal& traversal, const RayPacket& rays, std::size_t index, Packet& packet,
                   EmbreeRays& ready) const;
    /// Finds the nearest hits of a packet, for `packet_query`; returns the rays that hit.
    template <int Size>
    LaneMask find_hits(const RayPacket& rays, std::size_t index, const Traversal& traversal);
    template <int Size>
    LaneMask cast_packet(const RayPacket& rays, std::size_t index, std::span<Hit> hits);
    LaneMask test_singles(const RayPacket& rays, std::size_t index);
    template <int Size>
    LaneMask test_packet(const RayPacket& rays, std::size_t index);
    /// Finds the occluded rays of a packet and their optical depths, for `packet_occlusion`; returns the rays that do
    /// not miss the scene's box.
    template <int Size>
    LaneMask find_occlusions(const RayPacket& rays, std::size_t index, const Absorption* absorption);
    template <int Size>
    void attenuate_packet(const RayPacket& rays, std::size_t index, const Absorption& absorption,
                          std::span<double> transmitted);

    /// The depth of all crossings of a ray with what shadow rays see.
    Absorption::Depth listed_depth(const Ray& ray, std::size_t index, const Absorption& absorption) const;

    const SceneSnapshot::Impl& scene;
    const Traversal camera, shadow;
    bool complete;
    std::uint64_t ray_count = 0; ///< added to the scene's at the end, so that threads do not share a counter
    int packet_size = 0;         ///< 0 if rays are traced one by one
    RayQuery query;
    PreparedPacket prepared;
    LatticeRayPacket local; ///< in the space of the only instance
    std::optional<PacketQuery> packet_query;
    std::optional<PacketOcclusion> packet_occlusion; ///< made when it is needed
};

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

template <int Size, class Packet, class EmbreeRays>
LaneMask RayCaster::Impl::begin(const Traversal& traversal, const RayPacket& rays, std::size_t index, Packet& packet,
                                EmbreeRays& ready) const
{
    const LaneMask used = prepare_packet(rays, index, scene.frame, packet.prepared);
    if (used == 0)
        return 0;
    packet.begin(rays, used);
    if (const Instance* const alone = traversal.alone; alone != nullptr) {
        to_lattice(packet.prepared, alone->placement.centred_to_local, alone->object->cell_shape(), packet.in_lattice);
        packet.slot_in_lattice = packet.instID[0] = traversal.slot; // as in a scene of instances
        set_rays<Size>(packet.in_lattice, ready);
    } else {
        set_rays<Size>(packet.prepared, ready);
    }
    return used;
}

template <int Size>
LaneMask RayCaster::Impl::find_hits(const RayPacket& rays, std::size_t index, const Traversal& traversal)
{
    PacketQuery& packet = *packet_query;
    alignas(64) RTCRayHitNt<Size> ray_hits;
    const LaneMask used = begin<Size>(traversal, rays, index, packet, ray_hits);
    if (used == 0)
        return 0;
    const ValidLanes<Size> valid(used);
    embree::intersect_coherent(traversal.scene, packet, valid.flags, ray_hits);
    packet.rethrow();
    LaneMask hit_lanes = 0;
    for (LaneMask rest = used; rest != 0; rest &= rest - 1u)
        if (const int lane = std::countr_zero(rest); packet.has_hit(lane))
            hit_lanes |= LaneMask{1} << lane;
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

LaneMask RayCaster::Impl::test_singles(const RayPacket& rays, std::size_t index)
{
    LaneMask occluded = 0;
    RTCRayHit ray_hit;
    for (LaneMask rest = prepare_singles(rays, index, shadow); rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const Ray given = rays.ray(lane);
        const Ray ready = begin(shadow, given, lane);
        bool is_occluded = false;
        if (scene.reads_sources) {
            // Embree looks for any hit in any order, and would read far boxes in vain.
            set_ray(ready, ray_hit);
            embree::intersect(shadow.scene, query, ray_hit);
            is_occluded = query.has_hit();
        } else {
            set_ray(ready, ray_hit.ray);
            embree::occluded(shadow.scene, query, ray_hit.ray);
            is_occluded = ray_hit.ray.tfar < 0.0f;
        }
        query.rethrow();
        occluded |= static_cast<LaneMask>(is_occluded) << lane;
    }
    return occluded;
}

template <int Size>
LaneMask RayCaster::Impl::test_packet(const RayPacket& rays, std::size_t index)
{
    if (scene.reads_sources) // as test_singles()
        return find_hits<Size>(rays, index, shadow);
    return find_occlusions<Size>(rays, index, nullptr) != 0 ? packet_occlusion->occluded : 0;
}

template <int Size>
LaneMask RayCaster::Impl::find_occlusions(const RayPacket& rays, std::size_t index, const Absorption* absorption)
{
    if (!packet_occlusion)
        packet_occlusion.emplace(scene.instances);
    PacketOcclusion& packet = *packet_occlusion;
    packet.absorption = absorption;
    alignas(64) RTCRayNt<Size> ready;
    const LaneMask used = begin<Size>(shadow, rays, index, packet, ready);
    if (used == 0)
        return 0;
    const ValidLanes<Size> valid(used);
    embree::occluded<Size>(shadow.scene, packet, valid.flags, ready);
    packet.rethrow();
    packet.finish();
    return used;
}

template <int Size>
void RayCaster::Impl::attenuate_packet(const RayPacket& rays, std::size_t index, const Absorption& absorption,
                                       std::span<double> transmitted)
{
    std::fill_n(transmitted.begin(), rays.count, 1.0);
    for (LaneMask rest = find_occlusions<Size>(rays, index, &absorption); rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const bool is_decided = (packet_occlusion->undecided >> lane & 1u) == 0;
        const Absorption::Depth depth =
            is_decided ? packet_occlusion->depth[lane]
                       : listed_depth(rays.ray(lane), index + static_cast<std::size_t>(lane), absorption);
        transmitted[static_cast<std::size_t>(lane)] = Absorption::transmittance(depth);
    }
}

Absorption::Depth RayCaster::Impl::listed_depth(const Ray& ray, std::size_t index, const Absorption& absorption) const
{
    RayQuery of_all(scene.instances);
    std::vector<RawCrossing> raw;
    of_all.all = &raw;
    std::vector<ListedCrossing> crossings;
    scene.list(scene.shadow_top(), ray, index, of_all, crossings);
    Absorption::Depth depth = 0;
    for (const ListedCrossing& listed : crossings)
        depth = std::min(depth + absorption.depth(listed.crossing.hit, ray), Absorption::darkness);
    return depth;
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
    switch (impl_->packet_size) {
    case 16:
        return impl_->cast_packet<16>(rays, index, hits);
    case 8:
        return impl_->cast_packet<8>(rays, index, hits);
    case 4:
        return impl_->cast_packet<4>(rays, index, hits);
    default:
        return impl_->cast_singles(rays, index, hits);
    }
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

LaneMask RayCaster::test_occlusions(const RayPacket& rays, std::size_t index)
{
    check_packet(rays, width(), RayPacket::capacity);
    impl_->ray_count += static_cast<unsigned int>(rays.count);
    switch (impl_->packet_size) {
    case 16:
        return impl_->test_packet<16>(rays, index);
    case 8:
        return impl_->test_packet<8>(rays, index);
    case 4:
        return impl_->test_packet<4>(rays, index);
    default:
        return impl_->test_singles(rays, index);
    }
}

void RayCaster::attenuate(const RayPacket& rays, std::size_t index, const Absorption& absorption,
                          std::span<double> transmitted)
{
    check_packet(rays, width(), transmitted.size());
    impl_->ray_count += static_cast<unsigned int>(rays.count);
    switch (impl_->packet_size) {
    case 16:
        return impl_->attenuate_packet<16>(rays, index, absorption, transmitted);
    case 8:
        return impl_->attenuate_packet<8>(rays, index, absorption, transmitted);
    default:
        return impl_->attenuate_packet<4>(rays, index, absorption, transmitted);
    }
}

void SceneSnapshot::cast_rays(std::span<const Ray> rays, std::span<Hit> hits, bool coherent) const
{
    RayCaster(*this, coherent ? RayCaster::Rays::coherent : RayCaster::Rays::incoherent).cast(rays, hits);
}

void SceneSnapshot::test_occlusions(std::span<const Ray> rays, std::span<std::uint8_t> occluded, bool coherent) const
{
    check_one_per_ray("occluded", rays.size(), occluded.size());
    RayCaster caster(*this, coherent ? RayCaster::Rays::coherent : RayCaster::Rays::incoherent);
    for_each_packet(rays, caster.width(), [&](const RayPacket& packet, std::size_t first) {
        const LaneMask lanes = caster.test_occlusions(packet, first);
        for (int lane = 0; lane < packet.count; ++lane)
            occluded[first + static_cast<std::size_t>(lane)] = lanes >> lane & 1u;
    });
}

void SceneSnapshot::attenuate_rays(std::span<const Ray> rays, const Absorption& absorption,
                                   std::span<double> transmitted) const
{
    check_one_per_ray("transmitted", rays.size(), transmitted.size());
    RayCaster caster(*this, RayCaster::Rays::coherent);
    for_each_packet(rays, caster.width(), [&](const RayPacket& packet, std::size_t first) {
        caster.attenuate(packet, first, absorption, transmitted.subspan(first));
    });
}

} // namespace isospline
