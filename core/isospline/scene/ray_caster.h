// Casts rays at a scene, packet by packet.
#pragma once

#include "isospline/trace/hit.h"
#include "isospline/trace/ray_packet.h"

#include <cstddef>
#include <memory>
#include <span>

namespace isospline {

class SceneSnapshot;

/// The workspace of one thread that casts many rays at a snapshot, which must live as long. Rays and hits of a packet
/// stay in the cache from where they are made to where they are used.
class RayCaster {
public:
    /// Which rays a packet holds, and how they are traced: one by one, or together where they begin and run close to
    /// each other. The hits are the same.
    enum class Rays { incoherent, coherent };
    /// What is set of a hit: t, uv and ids, or all.
    enum class Parts { t_and_ids, all };

    explicit RayCaster(const SceneSnapshot& scene, Rays rays, Parts parts = Parts::all);
    ~RayCaster();
    RayCaster(const RayCaster&) = delete;
    RayCaster& operator=(const RayCaster&) = delete;

    /// Rays that a packet may hold: the lanes of the device.
    int width() const;

    /// First crossing of each ray of a packet within its [t_near, t_far]. Returns the lanes that hit, whose hits are
    /// set; others are left alone. Throws std::invalid_argument for a ray whose origin or direction is not finite or
    /// whose direction is zero; `index`, the number of the packet's first ray, tells which.
    LaneMask cast(const RayPacket& rays, std::size_t index, std::span<Hit> hits);

    /// The same for any number of rays, packet by packet; hits are misses where rays do not hit.
    void cast(std::span<const Ray> rays, std::span<Hit> hits);

    /// The lanes whose rays cross anything that test_occlusions() of the snapshot sees. One by one.
    LaneMask test_occlusions(const RayPacket& rays, std::size_t index);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace isospline
