#include "isospline/render/ray_batch.h"

#include "isospline/scene/ray_caster.h"
#include "isospline/scene/scene_snapshot.h"

#include <glm/geometric.hpp>

#include <cstdint>

namespace isospline {

void RayBatch::begin(std::span<const glm::ivec2> of_pixels, std::size_t first_sample, std::size_t sample_count)
{
    pixels.clear();
    samples.clear();
    for (const glm::ivec2& pixel : of_pixels)
        for (std::size_t i = 0; i < sample_count; ++i) {
            pixels.push_back(pixel);
            samples.push_back(static_cast<std::uint32_t>(first_sample + i));
        }
    drop_behind();
}

void RayBatch::drop_behind()
{
    rays.resize(pixels.size());
    hits.resize(pixels.size());
    behind.clear();
    weights.clear();
    origins_.clear();
}

glm::dvec3 RayBatch::origin(const SceneSnapshot& scene, std::size_t i, const glm::dvec3& towards)
{
    // Without a gradient, the direction matters, and not just its side.
    if (!(hits[i].gradient_magnitude > 0.0))
        return scene.offset_position(hits[i], towards);
    origins_.resize(hits.size());
    std::optional<glm::dvec3>& known = origins_[i][glm::dot(hits[i].normal, towards) >= 0.0 ? 1 : 0];
    if (!known)
        known = scene.offset_position(hits[i], towards);
    return *known;
}

void find_hits_through(RayBatch& batch, RayCaster& caster, const Absorption& absorption, const OpacityOf& opacity_of)
{
    // Rays that first meet an opaque surface are done. Without any, the first hits would be found twice.
    const bool has_opaque = absorption.has_opaque();
    const std::size_t ray_count = batch.rays.size();
    std::vector<Ray> translucent;
    std::vector<std::uint8_t> is_translucent(ray_count, 1);
    batch.weights.assign(ray_count, 0.0);
    if (has_opaque) {
        caster.cast(batch.rays, batch.hits);
        for (std::size_t i = 0; i < ray_count; ++i) {
            batch.weights[i] = batch.hits[i] ? opacity_of(batch.hits[i], batch.rays[i]) : 1.0;
            is_translucent[i] = batch.weights[i] < 1.0;
            if (is_translucent[i])
                translucent.push_back(batch.rays[i]);
        }
    }
    const std::vector<Ray>& listed = has_opaque ? translucent : batch.rays;
    std::vector<Crossing> crossings;
    std::vector<std::uint32_t> counts(listed.size());
    caster.list(listed, crossings, counts, &absorption);

    auto next = crossings.cbegin();
    auto count = counts.cbegin();
    for (std::size_t i = 0; i < ray_count; ++i) {
        batch.behind.push_back(batch.hits.size());
        if (!is_translucent[i])
            continue;
        const auto end = next + *count++;
        if (next != end || batch.weights[i] == 0.0)
            batch.hits[i].clear();
        double transmittance = 1.0;
        for (; next != end && transmittance >= Absorption::least_visible; ++next) {
            const double opacity = opacity_of(next->hit, batch.rays[i]);
            const double weight = transmittance * opacity;
            transmittance *= 1.0 - opacity;
            if (opacity == 0.0)
                continue;
            if (!batch.hits[i]) {
                batch.hits[i] = next->hit;
                batch.weights[i] = weight;
                continue;
            }
            batch.weights.push_back(weight);
            batch.rays.push_back(batch.rays[i]);
            batch.hits.push_back(next->hit);
        }
        next = end;
        // Nothing is seen through: the last surface has what is left.
        if (transmittance < Absorption::least_visible)
            (batch.hits.size() > batch.behind.back() ? batch.weights.back() : batch.weights[i]) += transmittance;
    }
    batch.behind.push_back(batch.hits.size());
}

} // namespace isospline
