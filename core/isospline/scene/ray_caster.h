// Casts rays at a scene, packet by packet.
#pragma once

#include "isospline/scene/scene_snapshot.h"
#include "isospline/trace/hit.h"
#include "isospline/trace/ray_packet.h"

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace isospline {

class Absorption;

/// The working memory of one thread that casts many rays at a snapshot. The snapshot must outlive it. Rays and hits of
/// a packet stay in the cache from where they are made to where they are used.
class RayCaster {
public:
    /// How the rays of a packet are traced: incoherent rays one by one, coherent rays together where they are so close
    /// that this is faster. The results are the same.
    enum class Rays { incoherent, coherent };
    /// The parts of a hit that are set: t, uv and ids, or all.
    enum class Parts { t_and_ids, all };

    /// What hits a triangle: crossings, of which a closed mesh has one on each edge, or also touches, on whichever side
    /// of an edge or corner a ray passes it within rounding; see triangle_touch(). Isosurfaces have crossings alone.
    enum class Contact { crossing, touch };

    /// Touches are for cast() of incoherent rays alone. `sees` tells which objects the rays of cast() and list() meet.
    explicit RayCaster(const SceneSnapshot& scene, Rays rays, Parts parts = Parts::all,
                       Contact contact = Contact::crossing, bool SeenBy::*sees = &SeenBy::camera);
    ~RayCaster();
    RayCaster(const RayCaster&) = delete;
    RayCaster& operator=(const RayCaster&) = delete;

    /// The largest number of rays in a packet: the lanes of the device.
    int width() const;

    /// First crossing of each ray of a packet within its [t_near, t_far]. Returns the lanes that hit and sets their
    /// hits; other hits are unchanged. Throws std::invalid_argument for more than width() rays, for fewer hits than
    /// rays, and for a ray whose origin or direction is not finite or whose direction is zero. `index` is the number of
    /// the packet's first ray, for this message. What a callback raises, a store that cannot be read for instance, is
    /// thrown; later calls are not affected.
    LaneMask cast(const RayPacket& rays, std::size_t index, std::span<Hit> hits);

    /// Rays are fastest in batches of so many packets; 1 if they are never in a stream.
    std::size_t batch_size() const;
    static constexpr std::size_t largest_batch = 16;

    /// The same for several packets. Sets the lanes of each packet that hit. The hit of lane i of packet p is
    /// hits[p * width() + i].
    void cast(std::span<const RayPacket> packets, std::size_t index, std::span<Hit> hits,
              std::span<LaneMask> hit_lanes);

    /// The same for any number of rays, with one hit for each ray. Hits of rays that hit nothing are
    /// set to misses.
    void cast(std::span<const Ray> rays, std::span<Hit> hits);

    /// The lanes whose rays cross any object that test_occlusions() of the snapshot sees. Throws like cast().
    LaneMask test_occlusions(const RayPacket& rays, std::size_t index);

    /// The same for several packets.
    void test_occlusions(std::span<const RayPacket> packets, std::size_t index, std::span<LaneMask> occluded);

    /// The same for any number of rays: 1 if a ray is occluded, otherwise 0.
    void test_occlusions(std::span<const Ray> rays, std::span<std::uint8_t> occluded);

    /// The part of the light that is left at the end of each ray of some packets, as in attenuate_rays() of the
    /// snapshot. For coherent rays alone. Throws like cast().
    void attenuate(std::span<const RayPacket> packets, std::size_t index, const Absorption& absorption,
                   std::span<double> transmitted, std::span<const double> thresholds = {});

    /// Appends the crossings of each ray, as list_intersections() of the snapshot does. For coherent rays
    /// alone. Throws like cast(). With an absorption, crossings behind which less than Absorption::least_visible of the
    /// light is left may be left out.
    void list(std::span<const Ray> rays, std::vector<Crossing>& crossings, std::span<std::uint32_t> counts,
              const Absorption* absorption = nullptr);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace isospline
