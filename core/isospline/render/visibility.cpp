#include "isospline/render/visibility.h"

#include "isospline/math/frame.h"
#include "isospline/scene/scene_snapshot.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace isospline {

namespace {

/// The shift of a pixel's sample in the unit square. The samples of a pixel are an additive recurrence of the plastic
/// number, whose terms are well separated. The pixels of a block of 4 x 4 begin at the points of a Hammersley set, so
/// that the block covers the square 16 times as finely (A. Keller, W. Heidrich, "Interleaved sampling", EGWR 2001), and
/// in the order of a Bayer matrix, so that neighbours differ most and the error has high frequencies only.
glm::dvec2 shift_of(const glm::ivec2& pixel, std::uint32_t sample)
{
    constexpr glm::dvec2 step(0.7548776662466927, 0.5698402909980532);
    const auto x = static_cast<unsigned>(pixel.x), y = static_cast<unsigned>(pixel.y), z = x ^ y;
    const unsigned reversed = (z & 1) << 3 | (y & 1) << 2 | (z & 2) | (y & 2) >> 1;
    const unsigned order = (y & 2) << 2 | (z & 2) << 1 | (y & 1) << 1 | (z & 1);
    return glm::fract(glm::dvec2(reversed, order) / 16.0 + static_cast<double>(sample) * step);
}

/// The i-th of `count` points of the unit square: Fibonacci's lattice, shifted.
glm::dvec2 lattice_point(std::size_t i, std::size_t count, const glm::dvec2& shift)
{
    constexpr double golden = 0.61803398874989484820;
    const auto place = static_cast<double>(i);
    return {(place + shift.x) / static_cast<double>(count), glm::fract(place * golden + shift.y)};
}

/// The segment from a hit to a point of a light.
Ray towards(const SceneSnapshot& scene, const Hit& hit, const PositionalLight& light, const glm::dvec2&)
{
    const glm::dvec3 origin = scene.offset_position(hit, light.position - hit.position);
    const glm::dvec3 to_light = light.position - origin;
    // A light at the point itself is not hidden.
    return to_light == glm::dvec3(0.0) ? Ray{origin, {0.0, 0.0, 1.0}, 0.0, 0.0} : Ray{origin, to_light, 0.0, 1.0};
}

Ray towards(const SceneSnapshot& scene, const Hit& hit, const DirectionalLight& light, const glm::dvec2& square)
{
    const glm::dvec3 to_light = light.to_point(square);
    return {scene.offset_position(hit, to_light), to_light};
}

/// Directions to the sky.
void append_sky(std::vector<Ray>& rays, const SceneSnapshot& scene, const Hit& hit, const glm::dvec3& normal,
                std::size_t count, double distance, const glm::dvec2& shift)
{
    const Frame frame(normal);
    const glm::dvec3 origin = scene.offset_position(hit, normal);
    for (std::size_t i = 0; i < count; ++i)
        rays.push_back({origin, frame.to_world(cosine_direction(lattice_point(i, count, shift))), 0.0, distance});
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

Visibility::Visibility(const SceneSnapshot& scene, const RayBatch& batch, const ShadingAt& shading_at,
                       const std::optional<Absorption>& absorption, std::uint32_t sample)
    : to_lights_(batch.hits.size()), to_sky_(batch.hits.size())
{
    const std::vector<Hit>& hits = batch.hits;
    std::vector<Ray> sky_rays;
    struct ToLight {
        Ray ray;
        std::size_t place; ///< in from_lights_
        double part;       ///< of the light
    };
    // By their number among the rays of a hit, because rays of neighbouring hits to one light are coherent.
    std::vector<std::vector<ToLight>> to_lights;
    for (std::size_t i = 0; i < hits.size(); ++i) {
        if (!hits[i])
            continue;
        const auto [shading, normal] = shading_at(hits[i], batch.rays[i]);
        // The hits of a ray share the samples by their weights: the noise is that of one opaque hit, or less.
        const double weight = batch.weights.empty() ? 1.0 : batch.weights[i];
        const glm::dvec2 shift = shift_of(batch.pixels[i], sample);
        if (const auto* phong = std::get_if<Phong>(shading); phong && phong->shadows && phong->lights) {
            to_lights_[i] = {from_lights_.size(), phong->lights->size()};
            const glm::dvec3 to_viewer = -glm::normalize(batch.rays[i].direction);
            std::size_t order = 0;
            for (const Light& light : *phong->lights) {
                const std::size_t place = from_lights_.size();
                const auto most = static_cast<std::size_t>(shadow_ray_count(*phong, light));
                const bool is_received = receives(*phong, light, hits[i].position, normal, to_viewer);
                const std::size_t count = is_received ? share(weight, most) : 0;
                from_lights_.push_back(0.0); // the sum of what follows; of a light that is not received, any number
                while (to_lights.size() < order + most)
                    to_lights.emplace_back().reserve(to_lights.size() < 4 ? hits.size() : 0);
                for (std::size_t j = 0; j < count; ++j) {
                    const glm::dvec2 square = lattice_point(j, count, shift);
                    const auto ray_to = [&](const auto& source) { return towards(scene, hits[i], source, square); };
                    to_lights[order + j].push_back(
                        {std::visit(ray_to, light), place, 1.0 / static_cast<double>(count)});
                }
                order += most;
            }
        } else if (const auto* occlusion = std::get_if<AmbientOcclusion>(shading)) {
            const std::size_t first = sky_rays.size();
            const bool away = glm::dot(hits[i].normal, batch.rays[i].direction) > 0.0;
            append_sky(sky_rays, scene, hits[i], away ? -hits[i].normal : hits[i].normal,
                       share(weight, static_cast<std::size_t>(occlusion->samples)), occlusion->distance, shift);
            to_sky_[i] = {first, sky_rays.size() - first};
        }
    }
    from_sky_ = transmittances(scene, sky_rays, absorption);

    std::vector<Ray> light_rays;
    light_rays.reserve(from_lights_.size());
    for (const std::vector<ToLight>& of_order : to_lights)
        for (const ToLight& each : of_order)
            light_rays.push_back(each.ray);
    const std::vector<double> transmitted = transmittances(scene, light_rays, absorption);
    auto part = transmitted.begin();
    for (const std::vector<ToLight>& of_order : to_lights)
        for (const ToLight& each : of_order)
            from_lights_[each.place] += each.part * *part++;
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
