#include "isospline/scene/packet_stream.h"

#include "isospline/scene/isosurface_object.h"

#include <bit>

namespace isospline {

PacketStream::PacketStream(const Traversal& traversal, std::span<const RayPacket> packets, std::size_t index,
                           std::span<LaneMask> found)
    : traversal_(traversal), instance_(*traversal.alone), object_(*instance_.object->with_stream()), packets_(packets),
      index_(index), found_(found)
{
}

void PacketStream::cast(std::span<PacketHits> hits)
{
    hits_ = hits;
    const auto record = [](void* self, int lane, const RayLimits& limits, const RootInCell& root,
                           const glm::ivec3& cell) {
        return static_cast<PacketStream*>(self)->record(lane, limits, root, cell);
    };
    object_.trace({.context = this, .next = &next_ray, .record = record});
}

void PacketStream::test_occlusions()
{
    const auto occlude = [](void* self, int lane) { static_cast<PacketStream*>(self)->set_found(lane); };
    object_.trace({.context = this, .next = &next_ray, .record = nullptr, .occlude = occlude});
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
    found_[begun_] = 0;
    rest_ = prepare_packet(packet, index_, traversal_.frame, prepared_);
    index_ += static_cast<std::size_t>(packet.count);
    ++begun_;
    if (rest_ == 0)
        return true;
    to_lattice(prepared_, instance_.placement.centred_to_local, object_.cell_shape(), local_);
    if (!hits_.empty())
        hits_[begun_ - 1].begin(local_.t_far);
    rest_ = object_.clip_rays(local_, rest_);
    return true;
}

double PacketStream::record(int lane, const RayLimits& limits, const RootInCell& root, const glm::ivec3& cell)
{
    const Place& place = places_[lane];
    PacketHits& hits = hits_[place.packet];
    hits.record(place.lane, root, {traversal_.slot, false, object_.primitive_id(cell)}, limits);
    set_found(lane);
    return hits.t_limit[place.lane];
}

} // namespace isospline
