#include "isospline/scene/packet_stream.h"
#include "isospline/scene/ray_caster_impl.h"
#include "isospline/scene/settling_gain.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <variant>

namespace isospline {

void SceneSnapshot::Impl::add_caps(const ChordOfInstance& of_instance, const Ray& ray, const RayLimits& limits,
                                   std::vector<ListedCrossing>& crossings) const
{
    const CappedChord& chord = of_instance.chord;
    const IsosurfaceSnapshot& surface = *of_instance.surface;
    const Instance& instance = *instances[of_instance.slot];
    const auto begin = std::partition_point(crossings.begin(), crossings.end(), [&](const ListedCrossing& listed) {
        return listed.crossing.hit.geometry_id < instance.id;
    });
    const auto end = std::partition_point(begin, crossings.end(), [&](const ListedCrossing& listed) {
        return listed.crossing.hit.geometry_id == instance.id;
    });
    std::optional<bool> first_enters, last_enters;
    if (begin != end) {
        first_enters = begin->crossing.entering;
        last_enters = std::prev(end)->crossing.entering;
    }
    const CappedEnds ends = chord.capped_ends(surface, first_enters, last_enters);
    const auto cap_at = [&](double t, int face, bool entering) {
        Crossing crossing{};
        crossing.hit.t = limits.given_t(t);
        crossing.hit.geometry_id = instance.id;
        crossing.hit.primitive_id = surface.cap_id(static_cast<std::size_t>(face));
        instance.object->complete(crossing.hit, ray, gradient_lattice(surface, chord.at(t)), instance.placement);
        crossing.entering = entering;
        return ListedCrossing{crossing, true};
    };
    const std::ptrdiff_t first = begin - crossings.begin();
    if (ends.exit)
        crossings.insert(end, cap_at(chord.t_far, chord.exit, false));
    if (ends.entry)
        crossings.insert(crossings.begin() + first, cap_at(chord.t_near, chord.entry, true));
}

namespace {

Crossing complete(const RawCrossing& raw, const Instance& instance, const Ray& ray, const RayLimits& limits)
{
    Crossing crossing{};
    crossing.hit.geometry_id = instance.id;
    crossing.hit.primitive_id = raw.primitive;
    if (const auto* in_cell = std::get_if<CrossingInCell>(&raw.found)) {
        crossing.hit.t = limits.given_t(in_cell->root.t);
        instance.object->complete(crossing.hit, ray, in_cell->root.gradient, instance.placement);
        crossing.entering = instance.object->is_entering(crossing.hit, ray, in_cell->rising);
    } else {
        const auto& in_mesh = std::get<TriangleHit>(raw.found);
        crossing.hit.t = in_mesh.t;
        crossing.hit.uv = in_mesh.uv;
        instance.object->complete(crossing.hit, ray, glm::dvec3(0.0), instance.placement);
        crossing.entering = in_mesh.entering;
    }
    return crossing;
}

} // namespace

void SceneSnapshot::Impl::list(bool SeenBy::*sees, const Ray& ray, std::size_t index, RayQuery& query,
                               std::vector<ListedCrossing>& crossings) const
{
    crossings.clear();
    if (!prepare(ray, index, met(sees).frame, query.prepared))
        return;
    query.all->clear();
    query.begin(ray);
    RTCRayHit ray_hit;
    set_ray(query.prepared.ray, ray_hit);
    embree::intersect(met(sees).top.get(), query, ray_hit);
    query.rethrow();
    list(ray, query.prepared.limits, *query.all, query.chords, crossings);
}

void SceneSnapshot::Impl::list(const Ray& ray, const RayLimits& limits, std::vector<RawCrossing>& raw,
                               const std::vector<ChordOfInstance>& chords, std::vector<ListedCrossing>& crossings) const
{
    crossings.clear();
    // Instance by instance, in the order in which the ray meets the crossings.
    std::sort(raw.begin(), raw.end(), [](const RawCrossing& a, const RawCrossing& b) {
        return std::tuple(a.slot, a.t_begin, a.t(), a.primitive) < std::tuple(b.slot, b.t_begin, b.t(), b.primitive);
    });
    std::vector<Crossing> of_instance;
    for (auto first = raw.begin(); first != raw.end();) {
        const Instance& instance = *instances[first->slot];
        const auto last =
            std::find_if(first, raw.end(), [&](const RawCrossing& each) { return each.slot != first->slot; });
        of_instance.clear();
        for (; first != last; ++first)
            of_instance.push_back(complete(*first, instance, ray, limits));
        instance.object->settle_order(of_instance, ray, instance.placement);
        for (const Crossing& crossing : of_instance)
            crossings.push_back({crossing, false});
    }
    for (const ChordOfInstance& chord : chords)
        add_caps(chord, ray, limits, crossings);

    // Then sort all by t, as in cast_rays(): see precedes(). Crossings of one instance at the same t stay together.
    for (std::size_t i = 1; i < crossings.size(); ++i) {
        const Hit &before = crossings[i - 1].crossing.hit, &hit = crossings[i].crossing.hit;
        if (hit.geometry_id == before.geometry_id && hit.t == before.t)
            crossings[i].sorts_as_cap = crossings[i - 1].sorts_as_cap;
    }
    std::stable_sort(crossings.begin(), crossings.end(), [](const ListedCrossing& a, const ListedCrossing& b) {
        const Hit &first = a.crossing.hit, &second = b.crossing.hit;
        if (first.t != second.t)
            return first.t < second.t;
        if (a.sorts_as_cap != b.sorts_as_cap)
            return b.sorts_as_cap;
        return a.sorts_as_cap ? first.geometry_id > second.geometry_id : first.geometry_id < second.geometry_id;
    });
}

void append_list(const std::vector<ListedCrossing>& of_ray, std::vector<Crossing>& crossings, std::uint32_t& count)
{
    if (of_ray.size() > std::numeric_limits<std::int32_t>::max())
        throw std::length_error("crossings of a ray: more than " +
                                std::to_string(std::numeric_limits<std::int32_t>::max()));
    for (const ListedCrossing& listed : of_ray)
        crossings.push_back(listed.crossing);
    count = static_cast<std::uint32_t>(of_ray.size());
}

void RayCaster::Impl::list_single(bool SeenBy::*meets, const Ray& ray, std::size_t index,
                                  std::vector<ListedCrossing>& crossings) const
{
    RayQuery of_all(scene.instances);
    std::vector<RawCrossing> raw;
    of_all.all = &raw;
    scene.list(meets, ray, index, of_all, crossings);
}

template <int Size>
LaneMask RayCaster::Impl::find_crossings(const Traversal& traversal, const RayPacket& rays, std::size_t index,
                                         const Absorption* absorption)
{
    if (absorption == nullptr)
        return find_occlusions<Size>(traversal, rays, index, nullptr, {}, &all);
    PacketOcclusion& packet = occlusion();
    packet.absorption = absorption;
    packet.all = &all;
    alignas(64) RTCRayHitNt<Size> ready;
    const LaneMask used = begin<Size>(traversal, rays, index, packet, ready);
    if (used == 0)
        return 0;
    packet.depths.begin(Absorption::invisibility);
    const ValidLanes<Size> valid(used);
    embree::intersect_coherent(traversal.scene, packet, valid.flags, ready);
    packet.rethrow();
    packet.finish();
    return used;
}

void RayCaster::Impl::append_lists(const RayPacket& rays, std::size_t index, LaneMask used,
                                   const RayLimitsPacket& limits, RawCrossings& found, std::vector<Crossing>& crossings,
                                   std::span<std::uint32_t> counts, const Absorption* absorption) const
{
    // Where a surface's crossings decide on its caps, they are needed even if they are not seen.
    const auto is_certain = [](const ChordOfInstance& of) { return of.chord.certain_ends(*of.surface).has_value(); };
    std::vector<ListedCrossing> of_ray;
    for (int lane = 0; lane < rays.count; ++lane) {
        of_ray.clear();
        const std::vector<ChordOfInstance>& chords = found.chords_of_ray[lane];
        const Ray ray = rays.ray(lane);
        const bool is_used = (used >> lane & 1u) != 0;
        if (is_used && absorption != nullptr && !std::ranges::all_of(chords, is_certain))
            list_single(sees, ray, index + static_cast<std::size_t>(lane), of_ray);
        else if (is_used)
            scene.list(ray, limits[lane], found.of_ray[lane], chords, of_ray);
        append_list(of_ray, crossings, counts[static_cast<std::size_t>(lane)]);
    }
}

template <int Size>
void RayCaster::Impl::list_packet(const RayPacket& rays, std::size_t index, std::vector<Crossing>& crossings,
                                  std::span<std::uint32_t> counts, const Absorption* absorption)
{
    const LaneMask used = find_crossings<Size>(seen, rays, index, absorption);
    append_lists(rays, index, used, occlusion().prepared.limits, all, crossings, counts, absorption);
}

template <int Size>
void RayCaster::Impl::list_stream(std::span<const RayPacket> packets, std::size_t index,
                                  std::vector<Crossing>& crossings, std::span<std::uint32_t> counts,
                                  const Absorption* absorption)
{
    stream_crossings.resize(std::max(stream_crossings.size(), packets.size()));
    std::vector<LaneMask> none_ends(packets.size());
    PacketStream(scene.instances, seen.met, packets, index, none_ends)
        .list(absorption, std::span(stream_crossings).first(packets.size()));
    const Traversal others{seen.met.others.get(), nullptr, 0, seen.met};
    for (std::size_t i = 0; i < packets.size(); ++i) {
        PacketCrossings& found = stream_crossings[i];
        LaneMask rest = others.scene != nullptr ? find_crossings<Size>(others, packets[i], index, absorption) : 0;
        for (; rest != 0; rest &= rest - 1u) {
            const int lane = std::countr_zero(rest);
            for (const RawCrossing& crossing : all.of_ray[lane])
                found.add(lane, crossing, absorption);
            std::swap(found.crossings.chords_of_ray[lane], all.chords_of_ray[lane]);
        }
        append_lists(packets[i], index, ~LaneMask{0}, found.limits, found.crossings, crossings, counts, absorption);
        const auto count = static_cast<std::size_t>(packets[i].count);
        index += count;
        counts = counts.subspan(count);
    }
}

void RayCaster::list(std::span<const Ray> rays, std::vector<Crossing>& crossings, std::span<std::uint32_t> counts,
                     const Absorption* absorption)
{
    check_one_per_ray("counts", rays.size(), counts.size());
    impl_->check_coherent();
    impl_->settling_gain += rays.size() * SettlingGain::of_ray_through_all;
    dispatch_packet_size(impl_->packet_size, [&](auto size) {
        for_each_batch(rays, width(), batch_size(), [&](std::span<const RayPacket> packets, std::size_t first) {
            const auto of_batch = counts.subspan(first);
            if (impl_->prefers_stream(impl_->seen, impl_->sees, packets, true))
                return impl_->list_stream<size>(packets, first, crossings, of_batch, absorption);
            for (const RayPacket& packet : packets) {
                impl_->list_packet<size>(packet, first, crossings, counts.subspan(first), absorption);
                first += static_cast<std::size_t>(packet.count);
            }
        });
    });
}

void SceneSnapshot::list_intersections(std::span<const Ray> rays, std::vector<Crossing>& crossings,
                                       std::span<std::uint32_t> counts, bool coherent) const
{
    check_one_per_ray("counts", rays.size(), counts.size());
    if (coherent)
        return RayCaster(*this, RayCaster::Rays::coherent).list(rays, crossings, counts);
    RayQuery query(impl_->instances);
    std::vector<RawCrossing> raw;
    query.all = &raw;
    std::vector<ListedCrossing> of_ray;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        impl_->list(&SeenBy::camera, rays[i], i, query, of_ray);
        append_list(of_ray, crossings, counts[i]);
    }
}

} // namespace isospline
