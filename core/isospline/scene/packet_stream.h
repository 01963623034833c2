// The rays of several packets, traced in a stream at one isosurface after the other.
#pragma once

#include "isospline/scene/absorption.h"
#include "isospline/scene/raw_crossings.h"
#include "isospline/scene/ray_query.h"
#include "isospline/scene/scene_snapshot_impl.h"
#include "isospline/trace/ray_stream.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace isospline {

/// The rays of packets as a stream, and what is found of them.
class PacketStream {
public:
    /// `index` is the number of the first ray. `found` are the lanes of each packet that hit.
    PacketStream(Instances instances, const Met& met, std::span<const RayPacket> packets, std::size_t index,
                 std::span<LaneMask> found);

    /// Finds the nearest hits of each packet.
    void cast(std::span<PacketHits> hits);
    /// Finds only which rays hit.
    void test_occlusions();
    /// Adds the depths of all crossings, each of the same depth at an instance. The rays that hit are those that reach
    /// the largest depth.
    void sum_depths(const Absorption& absorption, std::span<PacketDepths> depths);
    /// Lists all crossings, or with an absorption those that are seen.
    void list(const Absorption* absorption, std::span<PacketCrossings> crossings);

private:
    static bool next_ray(void* self, int lane, LatticeRayPacket& rays)
    {
        return static_cast<PacketStream*>(self)->next(lane, rays);
    }
    bool next(int lane, LatticeRayPacket& rays);
    double record(int lane, const RayLimits& limits, const RootInCell& root, const glm::ivec3& cell);
    bool add_depth(int lane, int crossings);
    double add_crossing(int lane, const CrossingInCell& crossing, double t_begin, const glm::ivec3& cell);
    /// The ends of the rays of a packet, which hits and crossings bring nearer; null if it has none.
    double* limits_of(std::size_t packet) const;
    void begin(std::size_t packet);
    void set_found(int lane) { found_[places_[lane].packet] |= LaneMask{1} << places_[lane].lane; }
    bool prepare_next_packet();
    /// Traces the rays at one instance after the other.
    void trace(const RayStream& stream);

    /// The packet and the lane of a ray that is under way.
    struct Place {
        std::size_t packet;
        int lane;
    };

    Instances instances_;
    const Met& met_;
    std::span<const RayPacket> packets_;
    const std::size_t first_index_;
    std::span<LaneMask> found_;
    std::span<PacketHits> hits_; ///< empty unless first hits are found
    std::span<PacketCrossings> crossings_;
    std::span<PacketDepths> depths_;
    const Absorption* absorption_ = nullptr;
    std::uint32_t slot_ = 0; ///< of the instance
    const Instance* instance_ = nullptr;
    const IsosurfaceObject* object_ = nullptr;
    bool is_first_ = true;  ///< of the instances
    std::size_t index_ = 0; ///< of the next packet's first ray
    std::size_t begun_ = 0; ///< packets of which rays have been taken
    LaneMask rest_ = 0;     ///< rays of the last one of them that have not been taken
    PreparedPacket prepared_;
    LatticeRayPacket local_;
    Place places_[packet_capacity];
};

} // namespace isospline
