// The members of a ray caster, shared by the sources that implement it.
#pragma once

#include "isospline/scene/packet_occlusion.h"
#include "isospline/scene/ray_caster.h"
#include "isospline/scene/scene_snapshot_impl.h"
#include "isospline/util/check.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace isospline {

/// Throws std::invalid_argument unless a packet has at most `width` rays, and a hit for each of them.
inline void check_packet(const RayPacket& rays, int width, std::size_t hits)
{
    if (rays.count < 0 || rays.count > width)
        throw_invalid("rays", "a packet of at most " + std::to_string(width) + " rays", rays.count);
    if (static_cast<std::size_t>(rays.count) > hits)
        throw_invalid("hits", "one for each of " + std::to_string(rays.count) + " rays", hits);
}

/// Throws std::invalid_argument unless there is a mask of lanes for each packet.
inline void check_lanes(const char* parameter, std::span<const RayPacket> packets, std::span<const LaneMask> lanes)
{
    if (lanes.size() < packets.size())
        throw_invalid(parameter, "one for each of " + std::to_string(packets.size()) + " packets", lanes.size());
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

/// Calls `body(packets, first)` for batches of up to `size` packets of up to `width` rays.
template <typename Body>
void for_each_batch(std::span<const Ray> rays, int width, std::size_t size, const Body& body)
{
    const auto of_packet = static_cast<std::size_t>(width);
    std::vector<RayPacket> batch(std::min(size, (rays.size() + of_packet - 1) / of_packet));
    std::size_t begun = 0;
    while (begun < rays.size()) {
        const std::size_t first = begun;
        std::size_t packets = 0;
        for (; packets < batch.size() && begun < rays.size(); ++packets) {
            RayPacket& packet = batch[packets];
            packet.count = static_cast<int>(std::min(of_packet, rays.size() - begun));
            for (int lane = 0; lane < packet.count; ++lane)
                packet.set(lane, rays[begun++]);
        }
        body(std::span<const RayPacket>(batch.data(), packets), first);
    }
}

/// Calls `body(packet, first)` for packets of up to `width` rays.
template <typename Body>
void for_each_packet(std::span<const Ray> rays, int width, const Body& body)
{
    for_each_batch(rays, width, 1,
                   [&](std::span<const RayPacket> packets, std::size_t first) { body(packets.front(), first); });
}

/// The number of rays in packets.
inline std::size_t ray_count(std::span<const RayPacket> packets)
{
    std::size_t count = 0;
    for (const RayPacket& packet : packets)
        count += static_cast<std::size_t>(packet.count);
    return count;
}

/// The items of some rays; none of an empty array.
template <typename Item>
std::span<Item> items_of(std::span<Item> all, std::size_t first, std::size_t count)
{
    return all.empty() ? all : all.subspan(first, count);
}

/// Calls `body` with the number of rays of Embree's packets, 4, 8 or 16, as a constant.
template <typename Body>
auto dispatch_packet_size(int size, const Body& body)
{
    switch (size) {
    case 16:
        return body(std::integral_constant<int, 16>());
    case 8:
        return body(std::integral_constant<int, 8>());
    default:
        return body(std::integral_constant<int, 4>());
    }
}

struct RayCaster::Impl {
    Impl(const SceneSnapshot::Impl& given_scene, Parts given_parts, bool SeenBy::*given_sees)
        : scene(given_scene), sees(given_sees), seen(scene.traversal(sees)), shadow(scene.traversal(&SeenBy::shadow)),
          complete(given_parts == Parts::all), query(scene.instances)
    {
    }
    ~Impl() { scene.settling_gain.fetch_add(settling_gain, std::memory_order_relaxed); }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    void check_coherent() const
    {
        if (packet_size == 0)
            throw_invalid("rays", "a caster of coherent rays", "one of incoherent rays");
    }
    /// The query of occlusions, which is made when it is needed.
    PacketOcclusion& occlusion()
    {
        return packet_occlusion ? *packet_occlusion : packet_occlusion.emplace(scene.instances);
    }
    /// Begins the query of a prepared ray, and returns the ray for Embree.
    Ray begin(const Traversal& traversal, const Ray& given, int lane);
    /// Prepares rays that are traced one by one; returns those that do not miss the scene's box.
    LaneMask prepare_singles(const RayPacket& rays, std::size_t index, const Traversal& traversal);
    LaneMask cast_singles(const RayPacket& rays, std::size_t index, std::span<Hit> hits);
    /// The largest number of rays in a packet.
    int width() const { return packet_size == 0 ? RayPacket::capacity : packet_size; }
    /// Whether there is a stream, and it is the fastest way for packets. The rays meet what SeenBy::* says, and
    /// `meets_all` tells that all that they cross counts.
    bool prefers_stream(const Traversal& traversal, bool SeenBy::*meets, std::span<const RayPacket> packets,
                        bool meets_all = false) const
    {
        const Met& met = traversal.met;
        return !met.streams.empty() &&
               (packet_size == 0 || !scene.coherence(meets).suit_packets(packets, met.others != nullptr, meets_all));
    }
    void cast_stream(std::span<const RayPacket> packets, std::size_t index, std::span<Hit> hits,
                     std::span<LaneMask> hit_lanes);
    /// Looks for nearer hits of a packet in what traces no rays in a stream; sets `mesh_hits`.
    void cast_at_others(const RayPacket& rays, std::size_t index, PacketHits& hits, LaneMask& hit_lanes);
    void test_stream(std::span<const RayPacket> packets, std::size_t index, std::span<LaneMask> occluded);
    /// Begins the query of a packet, and sets Embree's rays; returns the rays that do not miss the scene's box.
    template <int Size, class Packet, class EmbreeRays>
    LaneMask begin(const Traversal& traversal, const RayPacket& rays, std::size_t index, Packet& packet,
                   EmbreeRays& ready) const;
    /// Finds the nearest hits of a packet, for `packet_query`; returns the rays that hit.
    template <int Size>
    LaneMask find_hits(const RayPacket& rays, std::size_t index, const Traversal& traversal);
    /// Sets the hits of those lanes of a packet that hit; `in_meshes` are those of each lane, or null.
    void set_hits(const RayPacket& rays, LaneMask lanes, const PacketHits& found, const MeshHits* in_meshes,
                  std::span<Hit> hits) const;
    template <int Size>
    LaneMask cast_packet(const RayPacket& rays, std::size_t index, std::span<Hit> hits);
    /// The occluded ones of some rays.
    LaneMask test_singles(const RayPacket& rays, std::size_t index, RTCScene in, LaneMask lanes);
    template <int Size>
    LaneMask test_packet(const RayPacket& rays, std::size_t index);
    /// Finds the occluded rays of a packet and their optical depths, or all crossings, for `packet_occlusion`; returns
    /// the rays that do not miss the scene's box.
    template <int Size>
    LaneMask find_occlusions(const Traversal& traversal, const RayPacket& rays, std::size_t index,
                             const Absorption* absorption, std::span<const double> thresholds = {},
                             RawCrossings* all = nullptr);
    /// The same, also of the undecided rays.
    template <int Size>
    LaneMask find_depths(const Traversal& traversal, const RayPacket& rays, std::size_t index,
                         const Absorption& absorption, std::span<const double> thresholds);
    template <int Size>
    void attenuate_packet(const RayPacket& rays, std::size_t index, const Absorption& absorption,
                          std::span<double> transmitted, std::span<const double> thresholds);
    /// Adds the depths in what traces no rays in a stream, unless all rays are dark.
    template <int Size>
    void add_depths_of_others(const RayPacket& rays, std::size_t index, const Absorption& absorption,
                              std::span<const double> thresholds, PacketDepths& depths);
    template <int Size>
    void attenuate_stream(std::span<const RayPacket> packets, std::size_t index, const Absorption& absorption,
                          std::span<double> transmitted, std::span<const double> thresholds);

    template <int Size>
    void list_packet(const RayPacket& rays, std::size_t index, std::vector<Crossing>& crossings,
                     std::span<std::uint32_t> counts, const Absorption* absorption);
    template <int Size>
    void list_stream(std::span<const RayPacket> packets, std::size_t index, std::vector<Crossing>& crossings,
                     std::span<std::uint32_t> counts, const Absorption* absorption);
    /// Sets `all` to the crossings of a packet, or with an absorption to those that are seen; returns the rays that do
    /// not miss the scene's box, for which alone it is set.
    template <int Size>
    LaneMask find_crossings(const Traversal& traversal, const RayPacket& rays, std::size_t index,
                            const Absorption* absorption);
    /// Appends the lists of a packet's rays, of those that are `used` from what was found.
    void append_lists(const RayPacket& rays, std::size_t index, LaneMask used, const RayLimitsPacket& limits,
                      RawCrossings& found, std::vector<Crossing>& crossings, std::span<std::uint32_t> counts,
                      const Absorption* absorption) const;

    /// Lists the crossings of one ray.
    void list_single(bool SeenBy::*meets, const Ray& ray, std::size_t index,
                     std::vector<ListedCrossing>& crossings) const;
    /// The depth of all crossings of a ray with what shadow rays see.
    Absorption::Depth listed_depth(const Ray& ray, std::size_t index, const Absorption& absorption) const;

    const SceneSnapshot::Impl& scene;
    bool SeenBy::*const sees; ///< of the rays of cast() and list()
    const Traversal seen, shadow;
    bool complete;
    std::uint64_t settling_gain = 0; ///< added to the scene's at the end, so that threads do not share a counter
    int packet_size = 0;             ///< 0 if rays are traced one by one
    RayQuery query;
    PreparedPacket prepared;
    LatticeRayPacket local;              ///< in the space of the only instance
    std::vector<PacketHits> stream_hits; ///< of the packets of a stream
    std::vector<PacketCrossings> stream_crossings;
    MeshHits mesh_hits[packet_capacity]; ///< of one of them
    std::optional<PacketQuery> packet_query;
    std::optional<PacketOcclusion> packet_occlusion;
    RawCrossings all; ///< of a packet
};

template <int Size, class Packet, class EmbreeRays>
LaneMask RayCaster::Impl::begin(const Traversal& traversal, const RayPacket& rays, std::size_t index, Packet& packet,
                                EmbreeRays& ready) const
{
    const LaneMask used = prepare_packet(rays, index, traversal.met.frame, packet.prepared);
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
LaneMask RayCaster::Impl::find_occlusions(const Traversal& traversal, const RayPacket& rays, std::size_t index,
                                          const Absorption* absorption, std::span<const double> thresholds,
                                          RawCrossings* crossings)
{
    PacketOcclusion& packet = occlusion();
    packet.absorption = absorption;
    packet.all = crossings;
    alignas(64) RTCRayNt<Size> ready;
    const LaneMask used = begin<Size>(traversal, rays, index, packet, ready);
    if (used == 0)
        return 0;
    packet.depths.begin(thresholds);
    const ValidLanes<Size> valid(used);
    embree::occluded<Size>(traversal.scene, packet, valid.flags, ready);
    packet.rethrow();
    packet.finish();
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
    return packet.hit_lanes;
}

} // namespace isospline
