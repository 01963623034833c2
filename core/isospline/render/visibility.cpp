#include "isospline/render/visibility.h"

#include "isospline/math/frame.h"
#include "isospline/math/random.h"
#include "isospline/scene/scene_snapshot.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <numeric>

namespace isospline {

namespace {

/// The segment from a hit to a light.
Ray towards(const SceneSnapshot& scene, const Hit& hit, const PositionalLight& light)
{
    const glm::dvec3 origin = scene.offset_position(hit, light.position - hit.position);
    const glm::dvec3 to_light = light.position - origin;
    // A light at the point itself is not hidden.
    return to_light == glm::dvec3(0.0) ? Ray{origin, {0.0, 0.0, 1.0}, 0.0, 0.0} : Ray{origin, to_light, 0.0, 1.0};
}

Ray towards(const SceneSnapshot& scene, const Hit& hit, const DirectionalLight& light)
{
    return {scene.offset_position(hit, light.to_light), light.to_light};
}

/// Directions to the sky, in the order of Fibonacci's lattice on the unit square, with a random shift for each pixel.
void append_sky(std::vector<Ray>& rays, const SceneSnapshot& scene, const Hit& hit, const glm::dvec3& normal,
                const AmbientOcclusion& occlusion, RandomSequence random)
{
    const Frame frame(normal);
    const glm::dvec3 origin = scene.offset_position(hit, normal);
    const glm::dvec2 shift = random.next2();
    for (int i = 0; i < occlusion.samples; ++i) {
        constexpr double golden = 0.61803398874989484820;
        const double turn = i * golden + shift.y;
        const glm::dvec3 direction = cosine_direction({(i + shift.x) / occlusion.samples, turn - std::floor(turn)});
        rays.push_back({origin, frame.to_world(direction), 0.0, occlusion.distance});
    }
}

/// The transmitted part of the light along each ray; without opacities, all or nothing.
std::vector<double> transmittances(const SceneSnapshot& scene, std::span<const Ray> rays, const OpacityOf& opacity_of)
{
    std::vector<double> result(rays.size(), 1.0);
    if (!opacity_of) {
        std::vector<std::uint8_t> occluded(rays.size());
        scene.test_occlusions(rays, occluded);
        for (std::size_t i = 0; i < rays.size(); ++i)
            result[i] = occluded[i] ? 0.0 : 1.0;
        return result;
    }
    std::vector<Crossing> crossings;
    std::vector<std::uint32_t> counts(rays.size());
    scene.list_occluders(rays, crossings, counts);
    auto next = crossings.cbegin();
    for (std::size_t i = 0; i < rays.size(); ++i)
        for (const auto end = next + counts[i]; next != end; ++next)
            result[i] *= 1.0 - opacity_of(next->hit, rays[i]);
    return result;
}

} // namespace

bool Visibility::is_needed_by(const Shading& shading)
{
    const auto* phong = std::get_if<Phong>(&shading);
    return (phong && phong->shadows) || std::holds_alternative<AmbientOcclusion>(shading);
}

Visibility::Visibility(const SceneSnapshot& scene, const RayBatch& batch,
                       const std::function<const Shading&(const Hit&)>& shading_of, const OpacityOf& opacity_of,
                       std::uint32_t sample)
    : to_lights_(batch.hits.size()), to_sky_(batch.hits.size())
{
    const std::vector<Hit>& hits = batch.hits;
    std::vector<Ray> shadow_rays;
    for (std::size_t i = 0; i < hits.size(); ++i) {
        if (!hits[i])
            continue;
        const Shading& shading = shading_of(hits[i]);
        const std::size_t first = shadow_rays.size();
        if (const auto* phong = std::get_if<Phong>(&shading); phong && phong->shadows && phong->lights) {
            for (const Light& light : *phong->lights)
                shadow_rays.push_back(
                    std::visit([&](const auto& source) { return towards(scene, hits[i], source); }, light));
            to_lights_[i] = {first, shadow_rays.size() - first};
        } else if (const auto* occlusion = std::get_if<AmbientOcclusion>(&shading)) {
            const bool away = glm::dot(hits[i].normal, batch.rays[i].direction) > 0.0;
            append_sky(shadow_rays, scene, hits[i], away ? -hits[i].normal : hits[i].normal, *occlusion,
                       RandomSequence(batch.pixels[i], sample));
            to_sky_[i] = {first, shadow_rays.size() - first};
        }
    }
    transmittances_ = transmittances(scene, shadow_rays, opacity_of);
}

std::span<const double> Visibility::lit(std::size_t i) const
{
    if (to_lights_.empty())
        return {};
    return std::span(transmittances_).subspan(to_lights_[i].first, to_lights_[i].count);
}

double Visibility::openness(std::size_t i) const
{
    if (to_sky_.empty() || to_sky_[i].count == 0)
        return 1.0;
    const auto of_hit = std::span(transmittances_).subspan(to_sky_[i].first, to_sky_[i].count);
    return std::accumulate(of_hit.begin(), of_hit.end(), 0.0) / static_cast<double>(of_hit.size());
}

} // namespace isospline
