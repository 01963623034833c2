// Shadow rays: whether they are occluded, and how much light is left.
#include "isospline/scene/packet_stream.h"
#include "isospline/scene/ray_caster_impl.h"
#include "isospline/scene/settling_gain.h"

#include <algorithm>
#include <bit>
#include <vector>

namespace isospline {

LaneMask RayCaster::Impl::test_singles(const RayPacket& rays, std::size_t index, RTCScene in, LaneMask lanes)
{
    LaneMask occluded = 0;
    RTCRayHit ray_hit;
    for (LaneMask rest = prepare_singles(rays, index, shadow) & lanes; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const Ray given = rays.ray(lane);
        const Ray ready = begin(shadow, given, lane);
        bool is_occluded = false;
        if (scene.reads_sources) {
            // Embree looks for any hit in any order, and would read far boxes in vain.
            set_ray(ready, ray_hit);
            embree::intersect(in, query, ray_hit);
            is_occluded = query.has_hit();
        } else {
            set_ray(ready, ray_hit.ray);
            embree::occluded(in, query, ray_hit.ray);
            is_occluded = ray_hit.ray.tfar < 0.0f;
        }
        query.rethrow();
        occluded |= static_cast<LaneMask>(is_occluded) << lane;
    }
    return occluded;
}

void RayCaster::Impl::test_stream(std::span<const RayPacket> packets, std::size_t index, std::span<LaneMask> occluded)
{
    PacketStream(scene.instances, shadow.met, packets, index, occluded).test_occlusions();
    for (std::size_t i = 0; shadow.met.others != nullptr && i < packets.size(); ++i) {
        occluded[i] |= test_singles(packets[i], index, shadow.met.others.get(), ~occluded[i]);
        index += static_cast<std::size_t>(packets[i].count);
    }
}

template <int Size>
LaneMask RayCaster::Impl::test_packet(const RayPacket& rays, std::size_t index)
{
    if (scene.reads_sources) // as test_singles()
        return find_hits<Size>(rays, index, shadow);
    return find_occlusions<Size>(shadow, rays, index, nullptr) != 0 ? packet_occlusion->occluded : 0;
}

template <int Size>
LaneMask RayCaster::Impl::find_depths(const Traversal& traversal, const RayPacket& rays, std::size_t index,
                                      const Absorption& absorption, std::span<const double> thresholds)
{
    const LaneMask used = find_occlusions<Size>(traversal, rays, index, &absorption, thresholds);
    for (LaneMask rest = used != 0 ? packet_occlusion->undecided : 0; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        packet_occlusion->depths.depth[lane] =
            listed_depth(rays.ray(lane), index + static_cast<std::size_t>(lane), absorption);
    }
    return used;
}

namespace {

/// Sets the part of the light that is left of some rays of a packet.
void set_transmitted(const PacketDepths& depths, LaneMask lanes, std::span<const double> thresholds,
                     std::span<double> transmitted)
{
    for (LaneMask rest = lanes; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const auto place = static_cast<std::size_t>(lane);
        const bool is_all_or_nothing = !thresholds.empty() && thresholds[place] > 0.0;
        transmitted[place] = is_all_or_nothing ? static_cast<double>(depths.depth[lane] < depths.largest[lane])
                                               : Absorption::transmittance(depths.depth[lane]);
    }
}

} // namespace

template <int Size>
void RayCaster::Impl::attenuate_packet(const RayPacket& rays, std::size_t index, const Absorption& absorption,
                                       std::span<double> transmitted, std::span<const double> thresholds)
{
    std::fill_n(transmitted.begin(), rays.count, 1.0);
    if (const LaneMask used = find_depths<Size>(shadow, rays, index, absorption, thresholds); used != 0)
        set_transmitted(packet_occlusion->depths, used, thresholds, transmitted);
}

template <int Size>
void RayCaster::Impl::add_depths_of_others(const RayPacket& rays, std::size_t index, const Absorption& absorption,
                                           std::span<const double> thresholds, PacketDepths& depths)
{
    const Traversal others{shadow.met.others.get(), nullptr, 0, shadow.met};
    for (LaneMask rest = find_depths<Size>(others, rays, index, absorption, thresholds); rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const Absorption::Depth found = packet_occlusion->depths.depth[lane];
        if ((packet_occlusion->undecided >> lane & 1u) != 0)
            depths.depth[lane] = found; // of all that the ray crosses
        else
            depths.add(lane, found);
    }
}

template <int Size>
void RayCaster::Impl::attenuate_stream(std::span<const RayPacket> packets, std::size_t index,
                                       const Absorption& absorption, std::span<double> transmitted,
                                       std::span<const double> thresholds)
{
    std::vector<LaneMask> dark(packets.size());
    std::vector<PacketDepths> depths(packets.size());
    std::size_t first = 0;
    for (std::size_t i = 0; i < packets.size(); ++i) {
        const auto count = static_cast<std::size_t>(packets[i].count);
        depths[i].begin(items_of(thresholds, first, count));
        first += count;
    }
    PacketStream(scene.instances, shadow.met, packets, index, dark).sum_depths(absorption, depths);
    first = 0;
    for (std::size_t i = 0; i < packets.size(); ++i) {
        const RayPacket& rays = packets[i];
        const auto count = static_cast<std::size_t>(rays.count);
        const LaneMask all = (LaneMask{1} << rays.count) - 1u;
        const auto of_packet = items_of(thresholds, first, count);
        if (shadow.met.others != nullptr && dark[i] != all)
            add_depths_of_others<Size>(rays, index + first, absorption, of_packet, depths[i]);
        set_transmitted(depths[i], all, of_packet, items_of(transmitted, first, count));
        first += count;
    }
}

Absorption::Depth RayCaster::Impl::listed_depth(const Ray& ray, std::size_t index, const Absorption& absorption) const
{
    std::vector<ListedCrossing> crossings;
    list_single(&SeenBy::shadow, ray, index, crossings);
    Absorption::Depth depth = 0;
    for (const ListedCrossing& listed : crossings)
        depth = std::min(depth + absorption.depth(listed.crossing.hit, ray), Absorption::darkness);
    return depth;
}

LaneMask RayCaster::test_occlusions(const RayPacket& rays, std::size_t index)
{
    LaneMask occluded;
    test_occlusions({&rays, 1}, index, {&occluded, 1});
    return occluded;
}

void RayCaster::test_occlusions(std::span<const RayPacket> packets, std::size_t index, std::span<LaneMask> occluded)
{
    check_lanes("occluded", packets, occluded);
    for (const RayPacket& rays : packets)
        check_packet(rays, width(), RayPacket::capacity);
    impl_->settling_gain += SettlingGain::of_rays(ray_count(packets), impl_->packet_size != 0);
    if (impl_->prefers_stream(impl_->shadow, &SeenBy::shadow, packets))
        return impl_->test_stream(packets, index, occluded);
    for (std::size_t i = 0; i < packets.size(); ++i) {
        occluded[i] = impl_->packet_size == 0
                          ? impl_->test_singles(packets[i], index, impl_->shadow.scene, ~LaneMask{0})
                          : dispatch_packet_size(impl_->packet_size, [&](auto size) {
                                return impl_->test_packet<size>(packets[i], index);
                            });
        index += static_cast<std::size_t>(packets[i].count);
    }
}

void RayCaster::test_occlusions(std::span<const Ray> rays, std::span<std::uint8_t> occluded)
{
    check_one_per_ray("occluded", rays.size(), occluded.size());
    LaneMask lanes[largest_batch];
    for_each_batch(rays, width(), batch_size(), [&](std::span<const RayPacket> packets, std::size_t first) {
        test_occlusions(packets, first, lanes);
        for (std::size_t i = 0; i < packets.size(); ++i)
            for (int lane = 0; lane < packets[i].count; ++lane)
                occluded[first++] = lanes[i] >> lane & 1u;
    });
}

void RayCaster::attenuate(std::span<const RayPacket> packets, std::size_t index, const Absorption& absorption,
                          std::span<double> transmitted, std::span<const double> thresholds)
{
    impl_->check_coherent();
    for (const RayPacket& rays : packets)
        check_packet(rays, width(), RayPacket::capacity);
    const std::size_t count = ray_count(packets);
    check_one_per_ray("transmitted", count, transmitted.size());
    if (!thresholds.empty())
        check_one_per_ray("thresholds", count, thresholds.size());
    impl_->settling_gain += count * SettlingGain::of_ray_through_all;
    const std::vector<std::uint32_t>& streams = impl_->shadow.met.streams;
    const bool are_even = std::ranges::all_of(streams, [&](auto slot) { return absorption.depth(slot).has_value(); });
    const bool is_stream = are_even && impl_->prefers_stream(impl_->shadow, &SeenBy::shadow, packets, true);
    dispatch_packet_size(impl_->packet_size, [&](auto size) {
        if (is_stream)
            return impl_->attenuate_stream<size>(packets, index, absorption, transmitted, thresholds);
        for (std::size_t first = 0; const RayPacket& rays : packets) {
            const auto of_packet = static_cast<std::size_t>(rays.count);
            impl_->attenuate_packet<size>(rays, index + first, absorption, items_of(transmitted, first, of_packet),
                                          items_of(thresholds, first, of_packet));
            first += of_packet;
        }
    });
}

void SceneSnapshot::test_occlusions(std::span<const Ray> rays, std::span<std::uint8_t> occluded, bool coherent) const
{
    RayCaster(*this, coherent ? RayCaster::Rays::coherent : RayCaster::Rays::incoherent)
        .test_occlusions(rays, occluded);
}

void SceneSnapshot::attenuate_rays(std::span<const Ray> rays, const Absorption& absorption,
                                   std::span<double> transmitted, std::span<const double> thresholds) const
{
    check_one_per_ray("transmitted", rays.size(), transmitted.size());
    if (!thresholds.empty())
        check_one_per_ray("thresholds", rays.size(), thresholds.size());
    RayCaster caster(*this, RayCaster::Rays::coherent);
    for_each_batch(rays, caster.width(), caster.batch_size(),
                   [&](std::span<const RayPacket> packets, std::size_t first) {
                       const auto of_batch = [&](auto all) { return all.subspan(first, ray_count(packets)); };
                       caster.attenuate(packets, first, absorption, of_batch(transmitted),
                                        thresholds.empty() ? thresholds : of_batch(thresholds));
                   });
}

} // namespace isospline
