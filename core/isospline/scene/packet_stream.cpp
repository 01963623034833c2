#include "isospline/scene/packet_stream.h"

#include "isospline/scene/isosurface_object.h"

#include <algorithm>
#include <bit>

namespace isospline {

PacketStream::PacketStream(Instances instances, const Met& met, std::span<const RayPacket> packets, std::size_t index,
                           std::span<LaneMask> found)
    : instances_(instances), met_(met), packets_(packets), first_index_(index), found_(found)
{
}

void PacketStream::trace(const RayStream& stream)
{
    for (const std::uint32_t slot : met_.streams) {
        slot_ = slot;
        instance_ = instances_[slot].get();
        object_ = instance_->object->with_stream();
        index_ = first_index_;
        begun_ = 0;
        object_->trace(stream);
        is_first_ = false;
    }
}

void PacketStream::cast(std::span<PacketHits> hits)
{
    hits_ = hits;
    const auto record = [](void* self, int lane, const RayLimits& limits, const RootInCell& root,
                           const glm::ivec3& cell) {
        return static_cast<PacketStream*>(self)->record(lane, limits, root, cell);
    };
    trace({.context = this, .next = &next_ray, .record = record});
}

void PacketStream::test_occlusions()
{
    const auto occlude = [](void* self, int lane) { static_cast<PacketStream*>(self)->set_found(lane); };
    trace({.context = this, .next = &next_ray, .record = nullptr, .occlude = occlude});
}

void PacketStream::sum_depths(const Absorption& absorption, std::span<PacketDepths> depths)
{
    absorption_ = &absorption;
    depths_ = depths;
    const auto count = [](void* self, int lane, int crossings) {
        return static_cast<PacketStream*>(self)->add_depth(lane, crossings);
    };
    trace({.context = this, .next = &next_ray, .record = nullptr, .count = count});
}

void PacketStream::list(const Absorption* absorption, std::span<PacketCrossings> crossings)
{
    absorption_ = absorption;
    crossings_ = crossings;
    for (PacketCrossings& of_packet : crossings)
        of_packet.crossings.clear();
    const auto list = [](void* self, int lane, const CrossingInCell& crossing, double t_begin, const glm::ivec3& cell) {
        return static_cast<PacketStream*>(self)->add_crossing(lane, crossing, t_begin, cell);
    };
    trace({.context = this, .next = &next_ray, .record = nullptr, .list = list});
}

double PacketStream::add_crossing(int lane, const CrossingInCell& crossing, double t_begin, const glm::ivec3& cell)
{
    const Place& place = places_[lane];
    PacketCrossings& of_packet = crossings_[place.packet];
    of_packet.add(place.lane, {crossing, t_begin, slot_, object_->primitive_id(cell)}, absorption_);
    return of_packet.t_limit[place.lane];
}

bool PacketStream::add_depth(int lane, int crossings)
{
    const Place& place = places_[lane];
    const bool is_largest = depths_[place.packet].add(place.lane, crossings * *absorption_->depth(slot_));
    if (is_largest)
        set_found(lane);
    return is_largest;
}

bool PacketStream::next(int lane, LatticeRayPacket& rays)
{
    while (rest_ == 0)
        if (!prepare_next_packet())
            return false;
    const int from = std::countr_zero(rest_);
    rest_ &= rest_ - 1u;
    rays.set(lane, local_.ray(from));
    places_[lane] = {begun_ - 1, from};
    return true;
}

bool PacketStream::prepare_next_packet()
{
    if (begun_ == packets_.size())
        return false;
    const RayPacket& packet = packets_[begun_];
    LaneMask& found = found_[begun_];
    if (is_first_)
        found = 0;
    rest_ = prepare_packet(packet, index_, met_.frame, prepared_);
    if (hits_.empty())
        rest_ &= ~found; // nothing more is asked of occluded rays
    index_ += static_cast<std::size_t>(packet.count);
    ++begun_;
    if (rest_ == 0)
        return true;
    to_lattice(prepared_, instance_->placement.centred_to_local, object_->cell_shape(), local_);
    if (is_first_)
        begin(begun_ - 1);
    else if (double* const limits = limits_of(begun_ - 1); limits != nullptr)
        std::transform(local_.t_far, local_.t_far + packet_capacity, limits, local_.t_far,
                       [](double far, double limit) { return std::min(far, limit); });
    rest_ = object_->clip_rays(local_, rest_);
    return true;
}

void PacketStream::begin(std::size_t packet)
{
    if (!hits_.empty())
        hits_[packet].begin(local_.t_far);
    if (!crossings_.empty())
        crossings_[packet].begin(local_);
}

double* PacketStream::limits_of(std::size_t packet) const
{
    if (!hits_.empty())
        return hits_[packet].t_limit;
    return crossings_.empty() ? nullptr : crossings_[packet].t_limit;
}

double PacketStream::record(int lane, const RayLimits& limits, const RootInCell& root, const glm::ivec3& cell)
{
    const Place& place = places_[lane];
    PacketHits& hits = hits_[place.packet];
    hits.record(place.lane, root, {slot_, false, object_->primitive_id(cell)}, limits);
    set_found(lane);
    return hits.t_limit[place.lane];
}

} // namespace isospline
