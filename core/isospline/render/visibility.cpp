#include "isospline/render/visibility.h"

#include "isospline/math/frame.h"
#include "isospline/math/random.h"
#include "isospline/scene/scene_snapshot.h"

#include <glm/geometric.hpp>

#include <algorithm>
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
                int samples, double distance, RandomSequence random)
{
    const Frame frame(normal);
    const glm::dvec3 origin = scene.offset_position(hit, normal);
    const glm::dvec2 shift = random.next2();
    for (int i = 0; i < samples; ++i) {
        constexpr double golden = 0.61803398874989484820;
        const double turn = i * golden + shift.y;
        const glm::dvec3 direction = cosine_direction({(i + shift.x) / samples, turn - std::floor(turn)});
        rays.push_back({origin, frame.to_world(direction), 0.0, distance});
    }
}

/// Whether lights at infinity are points of one large light: as bright as each other, and close together.
bool are_one_light(const std::vector<Light>& lights)
{
    const auto* const first = std::get_if<DirectionalLight>(&lights.front());
    return first != nullptr && std::all_of(lights.begin(), lights.end(), [&](const Light& light) {
               const auto* const other = std::get_if<DirectionalLight>(&light);
               return other != nullptr && other->intensity == first->intensity &&
                      glm::dot(other->to_light, first->to_light) > 0.95;
           });
}

/// The share of one surface along a ray, at least one, in a number of samples.
std::size_t share(double weight, std::size_t samples)
{
    return std::max(std::size_t{1}, static_cast<std::size_t>(std::ceil(weight * static_cast<double>(samples))));
}

/// The transmitted part of the light along each ray; without an absorption, all or nothing. Neighbouring rays are
/// coherent: they begin at one hit or end at one light.
std::vector<double> transmittances(const SceneSnapshot& scene, std::span<const Ray> rays,
                                   const std::optional<Absorption>& absorption)
{
    std::vector<double> result(rays.size());
    if (absorption) {
        scene.attenuate_rays(rays, *absorption, result);
        return result;
    }
    std::vector<std::uint8_t> occluded(rays.size());
    scene.test_occlusions(rays, occluded, /*coherent=*/true);
    for (std::size_t i = 0; i < rays.size(); ++i)
        result[i] = occluded[i] ? 0.0 : 1.0;
    return result;
}

} // namespace

bool Visibility::is_needed_by(const Shading& shading)
{
    const auto* phong = std::get_if<Phong>(&shading);
    return (phong && phong->shadows) || std::holds_alternative<AmbientOcclusion>(shading);
}

Visibility::Visibility(const SceneSnapshot& scene, const RayBatch& batch,
                       const std::function<const Shading&(const Hit&)>& shading_of,
                       const std::optional<Absorption>& absorption, std::uint32_t sample)
    : to_lights_(batch.hits.size()), to_sky_(batch.hits.size())
{
    const std::vector<Hit>& hits = batch.hits;
    std::vector<Ray> sky_rays;
    std::size_t light_count = 0, most_lights = 0;
    std::vector<const std::vector<Light>*> lights(hits.size());
    std::vector<std::size_t> tested(hits.size()), first_tested(hits.size()); ///< of the lights
    // The hits of a ray share the samples by their weights: the noise is that of one opaque hit, or less.
    const auto weight = [&](std::size_t i) { return batch.weights.empty() ? 1.0 : batch.weights[i]; };
    for (std::size_t i = 0; i < hits.size(); ++i) {
        if (!hits[i])
            continue;
        const Shading& shading = shading_of(hits[i]);
        if (const auto* phong = std::get_if<Phong>(&shading); phong && phong->shadows && phong->lights) {
            lights[i] = &*phong->lights;
            const std::size_t count = lights[i]->size();
            to_lights_[i] = {light_count, count};
            tested[i] = count > 1 && weight(i) < 1.0 && are_one_light(*lights[i]) ? share(weight(i), count) : count;
            if (tested[i] < count)
                first_tested[i] = static_cast<std::size_t>(RandomSequence(batch.pixels[i], sample).next() *
                                                           static_cast<double>(count));
            light_count += count;
            most_lights = std::max(most_lights, lights[i]->size());
        } else if (const auto* occlusion = std::get_if<AmbientOcclusion>(&shading)) {
            const std::size_t first = sky_rays.size();
            const bool away = glm::dot(hits[i].normal, batch.rays[i].direction) > 0.0;
            append_sky(sky_rays, scene, hits[i], away ? -hits[i].normal : hits[i].normal,
                       static_cast<int>(share(weight(i), static_cast<std::size_t>(occlusion->samples))),
                       occlusion->distance, RandomSequence(batch.pixels[i], sample));
            to_sky_[i] = {first, sky_rays.size() - first};
        }
    }
    from_sky_ = transmittances(scene, sky_rays, absorption);

    // Light by light, because rays of neighbouring hits to one light are coherent.
    std::vector<Ray> light_rays;
    std::vector<std::size_t> places;
    for (std::size_t number = 0; number < most_lights; ++number)
        for (std::size_t i = 0; i < hits.size(); ++i) {
            if (number >= tested[i])
                continue;
            const std::size_t count = to_lights_[i].count;
            const std::size_t place = (first_tested[i] + number * count / tested[i]) % count;
            const Light& light = (*lights[i])[place];
            light_rays.push_back(
                std::visit([&](const auto& source) { return towards(scene, hits[i], source); }, light));
            places.push_back(to_lights_[i].first + place);
        }
    const std::vector<double> along_rays = transmittances(scene, light_rays, absorption);
    constexpr double unknown = -1.0;
    from_lights_.assign(light_count, unknown);
    for (std::size_t i = 0; i < places.size(); ++i)
        from_lights_[places[i]] = along_rays[i];
    // Points of one light that were not tested are as visible as the others.
    for (std::size_t i = 0; i < hits.size(); ++i) {
        if (tested[i] == to_lights_[i].count)
            continue;
        const auto of_hit = std::span(from_lights_).subspan(to_lights_[i].first, to_lights_[i].count);
        double sum = 0.0;
        for (const double part : of_hit)
            sum += std::max(part, 0.0);
        std::replace(of_hit.begin(), of_hit.end(), unknown, sum / static_cast<double>(tested[i]));
    }
}

std::span<const double> Visibility::lit(std::size_t i) const
{
    if (to_lights_.empty())
        return {};
    return std::span(from_lights_).subspan(to_lights_[i].first, to_lights_[i].count);
}

double Visibility::openness(std::size_t i) const
{
    if (to_sky_.empty() || to_sky_[i].count == 0)
        return 1.0;
    const auto of_hit = std::span(from_sky_).subspan(to_sky_[i].first, to_sky_[i].count);
    return std::accumulate(of_hit.begin(), of_hit.end(), 0.0) / static_cast<double>(of_hit.size());
}

} // namespace isospline
