#include "isospline/scene/scene_certifier.h"

#include "isospline/util/error.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <variant>

namespace isospline {

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

RayCertificate SceneCertifier::certify(const Ray& ray) const
{
    // A crossing of any surface is one of the scene, and ends the ray for the others.
    RayCertificate first;
    double first_doubt = first.t_lower;
    bool is_doubted = false;
    Ray rest = ray;
    for (const RayCertifier& surface : surfaces_) {
        const RayCertificate own = surface.certify(rest);
        first.t_lower = std::min(first.t_lower, own.t_lower);
        if (own.status == RayStatus::hit) {
            first.status = RayStatus::hit;
            first.t_upper = rest.t_far = own.t_upper;
        } else if (own.status == RayStatus::undecided) {
            first_doubt = std::min(first_doubt, own.t_lower);
            is_doubted = true;
        }
    }
    if (is_doubted && first_doubt <= first.t_upper)
        return {RayStatus::undecided, first.t_lower, std::numeric_limits<double>::infinity()};
    return first;
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
