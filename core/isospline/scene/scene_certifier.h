// First crossings of rays with a scene, with proven bounds: docs/method.md, "Certified rays".
#pragma once

#include "isospline/math/ray.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/trace/certified_ray.h"
#include "isospline/trace/ray_packet.h"

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace isospline {

/// Proves where rays first cross any of the isosurfaces that they see. Any number of threads may use it.
class SceneCertifier {
public:
    /// Throws std::invalid_argument for a scene with meshes among them, and for surfaces that RayCertifier rejects;
    /// `parameter` names what asked for proofs.
    SceneCertifier(const SceneSnapshot& scene, bool SeenBy::*sees, const char* parameter = "certify");

    /// The ray's numbers are finite, except for its limits. If the first crossing is near `t_hint`, which may be any
    /// number, it is found faster.
    RayCertificate certify(const Ray& ray, double t_hint = std::numeric_limits<double>::infinity()) const;
    /// The same for a packet of rays, given the t and the geometry ids of their hits; of misses, t is infinite.
    void certify(const RayPacket& rays, std::span<const double, packet_capacity> t_hits,
                 std::span<const std::uint32_t, packet_capacity> geometry_ids,
                 std::span<RayCertificate, packet_capacity> certificates) const;
    /// Whether the ray crosses any surface; nothing if that is not proven.
    std::optional<bool> is_crossed(const Ray& ray) const;
    /// Whether the number of crossings with all surfaces is odd; nothing if that is not proven.
    std::optional<bool> crosses_oddly(const Ray& ray) const;

private:
    struct Surface {
        std::uint32_t id;
        RayCertifier certifier;
    };

    std::vector<Surface> surfaces_;
};

} // namespace isospline
