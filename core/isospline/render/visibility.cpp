#include "isospline/render/visibility.h"

#include "isospline/math/frame.h"
#include "isospline/scene/scene_snapshot.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

namespace {

/// Steps of additive recurrences, the fractions of multiples of badly approximable numbers, whose terms are well
/// separated: of the golden ratio on a line, and of the plastic number in a square.
constexpr double golden = 0.61803398874989484820;
constexpr glm::dvec2 plastic(0.7548776662466927, 0.5698402909980532);

/// The random numbers of a pixel's sample.
struct Shifts {
    glm::dvec2 square; ///< of points of the unit square
    double number;     ///< of the sample in its block

    /// For the i-th of a sample's `count` rays: of the choice among the surfaces along the camera ray, and of the light
    /// that has to be left. Both are those of a recurrence over all rays of a block.
    glm::dvec2 of_ray(std::size_t i, std::size_t count) const
    {
        return glm::fract((number * static_cast<double>(count) + static_cast<double>(i)) * plastic);
    }
};

/// The samples of a pixel are an additive recurrence. The pixels of a block of 4 x 4 begin at the points of a
/// Hammersley set, so that the block covers the square 16 times as finely (A. Keller, W. Heidrich, "Interleaved
/// sampling", EGWR 2001), and in the order of a Bayer matrix, so that neighbours differ most and the error has high
/// frequencies only.
Shifts shifts_of(const glm::ivec2& pixel, std::uint32_t sample)
{
    const auto x = static_cast<unsigned>(pixel.x), y = static_cast<unsigned>(pixel.y), z = x ^ y;
    const unsigned reversed = (z & 1) << 3 | (y & 1) << 2 | (z & 2) | (y & 2) >> 1;
    const unsigned order = (y & 2) << 2 | (z & 2) << 1 | (y & 1) << 1 | (z & 1);
    return {glm::fract(glm::dvec2(reversed, order) / 16.0 + static_cast<double>(sample) * plastic),
            16.0 * sample + order};
}

/// The i-th of `count` points of the unit square: Fibonacci's lattice, shifted.
glm::dvec2 lattice_point(std::size_t i, std::size_t count, const glm::dvec2& shift)
{
    const auto place = static_cast<double>(i);
    return {(place + shift.x) / static_cast<double>(count), glm::fract(place * golden + shift.y)};
}

/// The segment from a hit of a batch to a point of a light.
Ray towards(const SceneSnapshot& scene, RayBatch& batch, std::size_t hit, const PositionalLight& light,
            const glm::dvec2&)
{
    const glm::dvec3 origin = batch.origin(scene, hit, light.position - batch.hits[hit].position);
    const glm::dvec3 to_light = light.position - origin;
    // A light at the point itself is not hidden.
    return to_light == glm::dvec3(0.0) ? Ray{origin, {0.0, 0.0, 1.0}, 0.0, 0.0} : Ray{origin, to_light, 0.0, 1.0};
}

Ray towards(const SceneSnapshot& scene, RayBatch& batch, std::size_t hit, const DirectionalLight& light,
            const glm::dvec2& square)
{
    const glm::dvec3 to_light = light.to_point(square);
    return {batch.origin(scene, hit, to_light), to_light};
}

bool is_disc(const Light& light)
{
    const auto* const directional = std::get_if<DirectionalLight>(&light);
    return directional != nullptr && directional->angle > 0.0;
}

/// A surface along a camera ray.
struct Surface {
    std::size_t hit;
    double weight; ///< in the colour of the ray
    const Shading* shading;
    glm::dvec3 normal;
};

/// The surfaces along a camera ray, without misses.
struct SurfacesAlongRay {
    std::vector<Surface> surfaces;
    glm::dvec3 to_viewer;
    Shifts shifts;
};

/// A surface that receives light from a source.
struct Receiver {
    const Surface* surface;
    double part;       ///< of what the camera ray shows of the source
    std::size_t place; ///< of the sum of the light that arrives
};

/// Shadow rays in groups of coherent ones.
class ShadowRayGroups {
public:
    explicit ShadowRayGroups(std::size_t hit_count) : hit_count_(hit_count) {}

    void add(std::size_t group, const Ray& ray, std::size_t place, double factor, double threshold)
    {
        while (groups_.size() <= group) {
            const std::size_t count = groups_.size() < 4 ? hit_count_ : 0;
            groups_.emplace_back();
            groups_.back().rays.reserve(count);
            groups_.back().ends.reserve(count);
        }
        groups_[group].rays.push_back(ray);
        groups_[group].ends.push_back({place, factor, threshold});
    }

    /// Adds the share of one surface in `count` rays by its weight, at least one: the noise of all surfaces along a ray
    /// is that of one opaque surface, or less. They are in groups from `first` on, one in each of `group_count`.
    /// `ray_to(point)` is the ray to the place of a source that a point of the unit square is mapped to.
    template <typename RayTo>
    void add_by_weight(const Surface& surface, std::size_t count, const Shifts& shifts, std::size_t first,
                       std::size_t group_count, std::size_t place, const RayTo& ray_to)
    {
        const double share = std::ceil(surface.weight * static_cast<double>(count));
        const auto its_count = std::max(std::size_t{1}, static_cast<std::size_t>(share));
        for (std::size_t i = 0; i < its_count; ++i)
            add(first + i % group_count, ray_to(lattice_point(i, its_count, shifts.square)), place,
                1.0 / static_cast<double>(its_count), 0.0);
    }

    /// Adds `count` rays, each from one of the receivers along a camera ray, which is chosen with the probability of
    /// its part. They transmit all or nothing. `rays_from(surface)` is the function `ray_to`.
    template <typename RaysFrom>
    void add_at_random(std::span<const Receiver> receivers, std::size_t count, const Shifts& shifts, std::size_t first,
                       std::size_t group_count, const RaysFrom& rays_from)
    {
        double total = 0.0;
        for (const Receiver& receiver : receivers)
            total += receiver.part;
        for (std::size_t i = 0; i < count && !receivers.empty(); ++i) {
            const glm::dvec2 random = shifts.of_ray(i, count);
            double rest = total * random.x;
            auto receiver = receivers.begin();
            for (; rest >= receiver->part && receiver + 1 != receivers.end(); ++receiver)
                rest -= receiver->part;
            add(first + i % group_count, rays_from(*receiver->surface)(lattice_point(i, count, shifts.square)),
                receiver->place, total / receiver->part / static_cast<double>(count), 1.0 - random.y);
        }
    }

    /// Adds the transmitted part of the light along each ray; without an absorption, all or nothing.
    void trace(const SceneSnapshot& scene, const std::optional<Absorption>& absorption, std::vector<double>& sums)
    {
        if (groups_.empty())
            return;
        Group all = std::move(groups_[0]);
        for (std::size_t i = 1; i < groups_.size(); ++i) {
            all.rays.insert(all.rays.end(), groups_[i].rays.begin(), groups_[i].rays.end());
            all.ends.insert(all.ends.end(), groups_[i].ends.begin(), groups_[i].ends.end());
        }
        if (!absorption) {
            std::vector<std::uint8_t> occluded(all.rays.size());
            scene.test_occlusions(all.rays, occluded, /*coherent=*/true);
            for (std::size_t i = 0; i < all.rays.size(); ++i)
                sums[all.ends[i].place] += occluded[i] ? 0.0 : all.ends[i].factor;
            return;
        }
        std::vector<double> transmitted(all.rays.size()), thresholds;
        for (const End& end : all.ends)
            thresholds.push_back(end.threshold);
        scene.attenuate_rays(all.rays, *absorption, transmitted, thresholds);
        for (std::size_t i = 0; i < all.rays.size(); ++i)
            sums[all.ends[i].place] += all.ends[i].factor * transmitted[i];
    }

private:
    /// What becomes of the light that arrives along a ray.
    struct End {
        std::size_t place; ///< of the sum to which it is added
        double factor;
        double threshold; ///< of attenuate_rays()
    };
    struct Group {
        std::vector<Ray> rays;
        std::vector<End> ends; ///< one for each ray
    };

    std::size_t hit_count_;
    std::vector<Group> groups_;
};

/// Whether rays of a shading look for hidden lights.
const Phong* with_shadows(const Shading& shading)
{
    const auto* const phong = std::get_if<Phong>(&shading);
    return phong != nullptr && phong->shadows && phong->lights ? phong : nullptr;
}

/// Adds the rays to the lights with a number; returns the number of groups that they are in. `place_of` gives the place
/// of the sum for a surface.
template <typename PlaceOf>
std::size_t add_rays_to_light(std::size_t number, const SceneSnapshot& scene, RayBatch& batch,
                              const SurfacesAlongRay& along, ShadowRays kind, std::size_t group,
                              const PlaceOf& place_of, std::vector<Receiver>& receivers, ShadowRayGroups& groups)
{
    receivers.clear();
    std::size_t most = 1;
    const auto rays_from = [&](const Surface& surface) {
        const Light& light = (*std::get<Phong>(*surface.shading).lights)[number];
        return [&scene, &batch, hit = surface.hit, &light](const glm::dvec2& point) {
            return std::visit([&](const auto& source) { return towards(scene, batch, hit, source, point); }, light);
        };
    };
    for (const Surface& surface : along.surfaces) {
        const Phong* const phong = with_shadows(*surface.shading);
        if (phong == nullptr || number >= phong->lights->size())
            continue;
        const Light& light = (*phong->lights)[number];
        const glm::dvec3& position = batch.hits[surface.hit].position;
        if (!receives(*phong, light, position, surface.normal, along.to_viewer))
            continue;
        const auto count = static_cast<std::size_t>(shadow_ray_count(*phong, light));
        most = std::max(most, count);
        if (!is_disc(light)) {
            groups.add(group, rays_from(surface)({}), place_of(surface), 1.0, 0.0);
        } else if (kind == ShadowRays::by_weight) {
            groups.add_by_weight(surface, count, along.shifts, group, count, place_of(surface), rays_from(surface));
        } else if (const double part = reflected(*phong, light, position, surface.normal, along.to_viewer);
                   part > 0.0) {
            receivers.push_back({&surface, surface.weight * part, place_of(surface)});
        }
    }
    groups.add_at_random(receivers, most, along.shifts, group, most, rays_from);
    return most;
}

/// The normal on the side that is seen. Where the gradient is zero, there is no normal: it is the way to the viewer.
glm::dvec3 side_seen(const glm::dvec3& normal, const glm::dvec3& to_viewer)
{
    if (normal == glm::dvec3(0.0))
        return to_viewer;
    return glm::dot(normal, to_viewer) < 0.0 ? -normal : normal;
}

void add_rays_to_sky(const SceneSnapshot& scene, RayBatch& batch, const SurfacesAlongRay& along, ShadowRays kind,
                     std::vector<Receiver>& receivers, ShadowRayGroups& groups)
{
    receivers.clear();
    std::size_t most = 1;
    const auto rays_from = [&](const Surface& surface) {
        const Hit& hit = batch.hits[surface.hit];
        const glm::dvec3 up = side_seen(hit.normal, along.to_viewer);
        return [origin = batch.origin(scene, surface.hit, up), frame = Frame(up),
                distance = std::get<AmbientOcclusion>(*surface.shading).distance](const glm::dvec2& point) {
            return Ray{origin, frame.to_world(cosine_direction(point)), 0.0, distance};
        };
    };
    for (const Surface& surface : along.surfaces) {
        const auto* const occlusion = std::get_if<AmbientOcclusion>(surface.shading);
        if (occlusion == nullptr)
            continue;
        const auto count = static_cast<std::size_t>(occlusion->samples);
        most = std::max(most, count);
        if (kind == ShadowRays::by_weight)
            groups.add_by_weight(surface, count, along.shifts, 0, 1, surface.hit, rays_from(surface));
        else
            receivers.push_back({&surface, surface.weight, surface.hit});
    }
    groups.add_at_random(receivers, most, along.shifts, 0, 1, rays_from);
}

} // namespace

bool Visibility::is_needed_by(const Shading& shading)
{
    const auto* phong = std::get_if<Phong>(&shading);
    return (phong && phong->shadows) || std::holds_alternative<AmbientOcclusion>(shading);
}

Visibility::Visibility(const SceneSnapshot& scene, RayBatch& batch, const ShadingAt& shading_at,
                       const std::optional<Absorption>& absorption, ShadowRays kind, int step)
    : to_lights_(batch.hits.size()), from_sky_(batch.hits.size())
{
    const bool all_opaque = batch.weights.empty();
    const std::size_t ray_count = all_opaque ? batch.hits.size() : batch.behind.size() - 1;
    // Rays of neighbouring hits to one light are coherent, and so are those of one hit to the sky.
    ShadowRayGroups to_lights(batch.hits.size()), to_sky(batch.hits.size());
    SurfacesAlongRay along;
    std::vector<Receiver> receivers;
    for (std::size_t ray = 0; ray < ray_count; ++ray) {
        along.surfaces.clear();
        std::size_t most_lights = 0;
        const auto add_surface = [&](std::size_t i) {
            if (!batch.hits[i])
                return;
            const auto [shading, normal] = shading_at(batch.hits[i], batch.rays[i]);
            along.surfaces.push_back({i, all_opaque ? 1.0 : batch.weights[i], shading, normal});
            if (const Phong* const phong = with_shadows(*shading)) {
                to_lights_[i] = {from_lights_.size(), phong->lights->size()};
                from_lights_.resize(from_lights_.size() + phong->lights->size());
                most_lights = std::max(most_lights, phong->lights->size());
            }
        };
        add_surface(ray);
        if (!all_opaque)
            for (std::size_t i = batch.behind[ray]; i < batch.behind[ray + 1]; ++i)
                add_surface(i);
        if (along.surfaces.empty())
            continue;
        along.to_viewer = -glm::normalize(batch.rays[ray].direction);
        along.shifts = shifts_of(batch.pixels[ray] / step, batch.samples[ray]);
        std::size_t group = 0;
        for (std::size_t number = 0; number < most_lights; ++number)
            group += add_rays_to_light(
                number, scene, batch, along, kind, group,
                [&](const Surface& surface) { return to_lights_[surface.hit].first + number; }, receivers, to_lights);
        add_rays_to_sky(scene, batch, along, kind, receivers, to_sky);
    }
    to_sky.trace(scene, absorption, from_sky_);
    to_lights.trace(scene, absorption, from_lights_);
}

std::span<const double> Visibility::lit(std::size_t i) const
{
    if (to_lights_.empty())
        return {};
    return std::span(from_lights_).subspan(to_lights_[i].first, to_lights_[i].count);
}

double Visibility::openness(std::size_t i) const
{
    return from_sky_.empty() ? 1.0 : from_sky_[i];
}

} // namespace isospline
