// The light that translucent surfaces take from rays that cross them.
#pragma once

#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/math/ray.h"
#include "isospline/trace/hit.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace isospline {

class SceneSnapshot;

/// The opacity, from 0 to 1, of the surface that a ray hit.
using OpacityOf = std::function<double(const Hit& hit, const Ray& ray)>;

/// The opacities of a snapshot's surfaces, as optical depths in fixed point. The sum of the depths of all crossings of
/// a ray does not depend on their order.
class Absorption {
public:
    using Depth = std::int64_t;
    /// Less than 1% of the light is left at this depth, and counts as none in shadows.
    static const Depth darkness;
    /// What is behind this depth is not seen: less than least_visible of its light is left.
    static const Depth invisibility;
    /// Of colours up to 1, this is less than half a step of a picture with 8 bits, which has sRGB's curve.
    static constexpr double least_visible = 0x1p-13;

    /// `even_opacity` is the opacity of the object with a geometry id, or nothing if it differs from point to point:
    /// then `opacity_of` is called for each crossing.
    Absorption(const SceneSnapshot& scene, const std::function<std::optional<double>(std::uint32_t)>& even_opacity,
               OpacityOf opacity_of);

    /// The depth of each crossing with the instance in a slot, or nothing if it differs from point to point.
    const std::optional<Depth>& depth(std::uint32_t slot) const { return depths_[slot]; }
    Depth depth(const Hit& hit, const Ray& ray) const;
    /// Whether an object is opaque everywhere.
    bool has_opaque() const;

    /// The part of the light that is left, from 0 to 1.
    static double transmittance(Depth depth);
    /// The smallest depth at which less than a part of the light is left, at most that of darkness.
    static Depth depth_of_part(double part);

private:
    std::vector<std::optional<Depth>> depths_; ///< by slot
    OpacityOf opacity_of_;
};

/// The optical depths of a packet's rays, of all crossings so far.
struct PacketDepths {
    void begin(Absorption::Depth largest_of_all)
    {
        std::fill_n(depth, packet_capacity, Absorption::Depth{0});
        std::fill_n(largest, packet_capacity, largest_of_all);
    }
    /// The same, up to the depths at which less than these parts of the light are left.
    void begin(std::span<const double> parts)
    {
        begin(Absorption::darkness);
        std::transform(parts.begin(), parts.end(), largest, Absorption::depth_of_part);
    }
    /// Returns whether the largest depth is reached: the sum stays there, and does not overflow.
    bool add(int lane, Absorption::Depth added)
    {
        depth[lane] = std::min(depth[lane] + added, largest[lane]);
        return is_largest(lane);
    }
    bool is_largest(int lane) const { return depth[lane] == largest[lane]; }

    Absorption::Depth depth[packet_capacity], largest[packet_capacity];
};

} // namespace isospline
