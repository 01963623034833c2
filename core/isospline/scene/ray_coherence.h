// How many rays are traced fastest: in packets, one by one, or sorted. The results are the same.
#pragma once

#include "isospline/math/box.h"
#include "isospline/math/ray.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/trace/ray_packet.h"
#include "isospline/util/progress.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace isospline {

/// Rays of an array, by their places in it.
using RayAt = std::function<Ray(std::size_t)>;

/// Tells how close rays are to each other where they may meet isosurfaces, or meshes if a scene has no isosurface.
class RayCoherence {
public:
    /// Rays of a group, as many as a packet of 16 lanes has. Fewer rays are not close to each other.
    static constexpr std::size_t group_size = 16;

    /// For rays that meet objects as SeenBy::camera or SeenBy::shadow says.
    RayCoherence(const SceneSnapshot::Impl& scene, bool SeenBy::*sees);

    /// Whether rays that follow each other are so close that packets trace them faster than single rays, whether they
    /// are so close, or so far from each other, that sorting pays, or neither.
    enum class Closeness { packets, sorting, none };
    /// It looks at some groups of rays, which are spread over the array.
    Closeness closeness(std::size_t count, const RayAt& ray_at) const;

    /// Whether packets are faster than a stream of their rays, for a scene that can trace both. `meets_others` tells
    /// that the rays also meet what traces none in a stream, `meets_all` that all that they cross counts. It looks at
    /// the first packet that meets the box.
    bool suit_packets(std::span<const RayPacket> packets, bool meets_others, bool meets_all) const;

    /// The places of the rays, in an order in which rays that follow each other have about the same direction and begin
    /// at about the same place, and so meet what the last ones have left in caches.
    std::vector<std::size_t> sorted(std::size_t count, const RayAt& ray_at, const Progress& progress) const;

private:
    /// How far the rays of a group are from each other, in cells.
    struct Spread {
        double of_entries, largest; ///< where they enter the box; there, or where they leave it
        int rays;                   ///< that meet the box
    };
    /// Nothing if no ray meets the box.
    std::optional<Spread> spread(std::size_t count, const RayAt& ray_at) const;
    /// The octant of a ray's direction, and the place where it enters the box.
    std::uint64_t key(const Ray& ray) const;

    Box box_;
    double cell_ = std::numeric_limits<double>::infinity(); ///< the size of cells of the largest object
};

} // namespace isospline
