// First crossings of rays with a scene, with proven bounds: docs/method.md, "Certified rays".
#pragma once

#include "isospline/math/ray.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/trace/certified_ray.h"
#include "isospline/trace/hit.h"
#include "isospline/trace/ray_packet.h"

#include <array>
#include <cstdint>
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

    /// The rays' numbers are finite, except for their limits. Given the t and the geometry ids of their hits; of
    /// misses, t is infinite.
    void certify(const RayPacket& rays, std::span<const double, packet_capacity> t_hits,
                 std::span<const std::uint32_t, packet_capacity> geometry_ids,
                 std::span<RayCertificate, packet_capacity> certificates) const;
    /// The same for any number of rays, given their hits, of which there may be more.
    void certify(std::span<const Ray> rays, std::span<const Hit> hits, std::vector<RayCertificate>& certificates) const;
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
