#include "isospline/scene/scene_certifier.h"

#include "isospline/util/error.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <variant>

namespace isospline {

namespace {

/// Nothing is known of the surface at the hit.
void forget_normal(RayCertificate& hit)
{
    hit.normal = glm::dvec3(0.0);
    hit.normal_angle = std::numbers::pi;
    hit.model_distance = std::numeric_limits<double>::infinity();
}

/// The first of the certificates of a ray with several surfaces. A crossing of any of them is one of the scene.
class FirstOfSurfaces {
public:
    void add(RayCertificate own)
    {
        if (own.status == RayStatus::hit) {
            if (!(own.t_upper < t_lower_))
                forget_normal(own); // another surface may be the first
            first_ = own;
        } else if (own.status == RayStatus::undecided && own.t_lower < doubt_.t_lower) {
            doubt_ = own;
        }
        t_lower_ = std::min(t_lower_, own.t_lower);
    }

    /// Where the ray ends for the surfaces that follow.
    double t_end() const { return first_.t_upper; }

    RayCertificate certificate() const
    {
        const bool is_doubted = doubt_.status == RayStatus::undecided && doubt_.t_lower <= first_.t_upper;
        RayCertificate result = is_doubted ? doubt_ : first_;
        if (is_doubted && t_lower_ < result.t_lower) // a hit of another surface may be the first
            result.level_bound = std::numeric_limits<double>::infinity();
        result.t_lower = t_lower_;
        return result;
    }

private:
    RayCertificate first_, doubt_;
    double t_lower_ = std::numeric_limits<double>::infinity();
};

} // namespace

SceneCertifier::SceneCertifier(const SceneSnapshot& scene, bool SeenBy::*sees, const char* parameter)
{
    for (const std::uint32_t id : scene.ids()) {
        const SnapshotObject& shown = scene.object(id);
        if (!(shown.seen_by.*sees))
            continue;
        const auto* const surface = std::get_if<std::shared_ptr<const IsosurfaceSnapshot>>(&shown.object);
        if (surface == nullptr)
            throw_invalid(parameter, "a scene of isosurfaces", "a mesh, geometry id " + std::to_string(id));
        surfaces_.push_back({id, RayCertifier(*surface, shown.transform, parameter)});
    }
}

void SceneCertifier::certify(const RayPacket& rays, std::span<const double, packet_capacity> t_hits,
                             std::span<const std::uint32_t, packet_capacity> geometry_ids,
                             std::span<RayCertificate, packet_capacity> certificates) const
{
    const LaneMask all = (LaneMask{1} << rays.count) - 1;
    if (surfaces_.size() == 1)
        return surfaces_.front().certifier.certify(rays, all, t_hits, certificates);

    std::array<FirstOfSurfaces, RayPacket::capacity> first;
    RayPacket rest = rays;
    const auto add = [&](const RayCertifier& surface, LaneMask lanes,
                         std::span<const double, packet_capacity> t_hints) {
        surface.certify(rest, lanes, t_hints, certificates);
        for (; lanes != 0; lanes &= lanes - 1) {
            const auto lane = static_cast<std::size_t>(std::countr_zero(lanes));
            first[lane].add(certificates[lane]);
            rest.t_far[lane] = std::min(rest.t_far[lane], first[lane].t_end());
        }
    };
    const auto lanes_of = [&](const Surface& surface) {
        LaneMask lanes = 0;
        for (std::size_t lane = 0; lane < static_cast<std::size_t>(rays.count); ++lane)
            lanes |= static_cast<LaneMask>(std::isfinite(t_hits[lane]) && geometry_ids[lane] == surface.id) << lane;
        return lanes;
    };
    // The surface that a ray hits comes first: its hit ends the ray for the others.
    for (const Surface& surface : surfaces_)
        if (const LaneMask lanes = lanes_of(surface); lanes != 0)
            add(surface.certifier, lanes, t_hits);
    std::array<double, RayPacket::capacity> no_hits;
    no_hits.fill(std::numeric_limits<double>::infinity());
    for (const Surface& surface : surfaces_)
        if (const LaneMask lanes = all & ~lanes_of(surface); lanes != 0)
            add(surface.certifier, lanes, no_hits);
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(rays.count); ++lane)
        certificates[lane] = first[lane].certificate();
}

void SceneCertifier::certify(std::span<const Ray> rays, std::span<const Hit> hits,
                             std::vector<RayCertificate>& certificates) const
{
    certificates.resize(rays.size());
    RayPacket packet;
    std::array<double, packet_capacity> t_hits = {};
    std::array<std::uint32_t, packet_capacity> geometry_ids = {};
    std::array<RayCertificate, packet_capacity> proven;
    for (std::size_t first = 0; first < rays.size(); first += packet_capacity) {
        const std::size_t count = std::min<std::size_t>(packet_capacity, rays.size() - first);
        packet.count = static_cast<int>(count);
        for (std::size_t i = 0; i < count; ++i) {
            packet.set(static_cast<int>(i), rays[first + i]);
            t_hits[i] = hits[first + i].t;
            geometry_ids[i] = hits[first + i].geometry_id;
        }
        certify(packet, t_hits, geometry_ids, proven);
        std::copy_n(proven.begin(), count, certificates.begin() + static_cast<std::ptrdiff_t>(first));
    }
}

std::optional<bool> SceneCertifier::is_crossed(const Ray& ray) const
{
    bool is_doubted = false;
    for (const auto& [id, surface] : surfaces_) {
        const std::optional<bool> crossed = surface.is_crossed(ray);
        if (crossed == true)
            return true;
        is_doubted |= !crossed;
    }
    return is_doubted ? std::nullopt : std::optional<bool>(false);
}

std::optional<bool> SceneCertifier::crosses_oddly(const Ray& ray) const
{
    bool odd = false;
    for (const auto& [id, surface] : surfaces_) {
        const std::optional<bool> of_surface = surface.crosses_oddly(ray);
        if (!of_surface)
            return std::nullopt;
        odd ^= *of_surface;
    }
    return odd;
}

} // namespace isospline
