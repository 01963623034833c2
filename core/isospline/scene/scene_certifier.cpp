#include "isospline/scene/scene_certifier.h"

#include "isospline/util/error.h"

#include <algorithm>
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
        surfaces_.emplace_back(*surface, shown.transform, parameter);
    }
}

RayCertificate SceneCertifier::certify(const Ray& ray, double t_hint) const
{
    // A crossing of any surface is one of the scene, and ends the ray for the others.
    RayCertificate first, doubt;
    double t_lower = first.t_lower;
    Ray rest = ray;
    for (const RayCertifier& surface : surfaces_) {
        RayCertificate own = surface.certify(rest, t_hint);
        if (own.status == RayStatus::hit) {
            if (!(own.t_upper < t_lower))
                forget_normal(own); // another surface may be the first
            first = own;
            rest.t_far = own.t_upper;
        } else if (own.status == RayStatus::undecided && own.t_lower < doubt.t_lower) {
            doubt = own;
        }
        t_lower = std::min(t_lower, own.t_lower);
    }
    RayCertificate& result = doubt.status == RayStatus::undecided && doubt.t_lower <= first.t_upper ? doubt : first;
    if (t_lower < result.t_lower) // a hit of another surface may be the first
        result.level_bound = std::numeric_limits<double>::infinity();
    result.t_lower = t_lower;
    return result;
}

std::optional<bool> SceneCertifier::is_crossed(const Ray& ray) const
{
    bool is_doubted = false;
    for (const RayCertifier& surface : surfaces_) {
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
    for (const RayCertifier& surface : surfaces_) {
        const std::optional<bool> of_surface = surface.crosses_oddly(ray);
        if (!of_surface)
            return std::nullopt;
        odd ^= *of_surface;
    }
    return odd;
}

} // namespace isospline
