#include "isospline/render/path_batch.h"

#include "isospline/math/frame.h"
#include "isospline/render/projection.h"
#include "isospline/render/surface_lookup.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/trace/hit.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>
#include <variant>
#include <vector>

namespace isospline {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// From this bounce on, paths may end at random (Russian roulette).
constexpr int first_roulette = 3;

/// Surfaces hide a light from here on, as a part of the distance to it: a lamp may lie in a surface.
constexpr double before_light = 1.0 - 1e-8;

/// Veach's power heuristic, for one sample of each kind.
double power_heuristic(double density, double other)
{
    // The quotient of densities does not overflow, unlike their squares.
    const double ratio = other / density;
    return 1.0 / (1.0 + ratio * ratio);
}

std::optional<LightSample> sample(const PositionalLight& light, const glm::dvec3& position, const glm::dvec2&)
{
    const glm::dvec3 offset = light.position - position;
    const double squared_distance = glm::dot(offset, offset);
    if (!(squared_distance > 0.0))
        return std::nullopt;
    const double distance = std::sqrt(squared_distance);
    return LightSample{offset / distance, distance, light.intensity / squared_distance, 0.0};
}

std::optional<LightSample> sample(const DirectionalLight& light, const glm::dvec3&, const glm::dvec2& u)
{
    return LightSample{light.to_point(u), infinity, light.intensity / light.mean_cosine(), 0.0};
}

std::optional<LightSample> sample(const EnvironmentLight& light, const glm::dvec3&, const glm::dvec2& u)
{
    return sample(light, u);
}

/// A path in progress.
struct Path {
    std::size_t index; ///< of its camera ray
    glm::dvec3 throughput{1.0};
    double density = infinity; ///< of the ray's direction in the material; infinite for a camera ray
};

/// Light that counts unless a surface is between.
struct Candidate {
    std::size_t index; ///< of its camera ray
    const Emitter* light;
    glm::dvec3 radiance;
};

class PathBatch {
public:
    PathBatch(const SceneSnapshot& scene, const PathTracer& path_tracer, const Projection& projection,
              std::span<const Ray> camera_rays, std::span<RandomSequence> random, std::span<PathResult> results)
        : scene_(scene), lookup_(scene), path_tracer_(path_tracer), projection_(projection), random_(random),
          results_(results)
    {
        // Lights for next-event estimation, chosen with equal probability.
        for (const Emitter& light : path_tracer.lights) {
            const auto* environment = std::get_if<EnvironmentLight>(&light);
            if (!environment || environment->map)
                chosen_from_.push_back(&light);
        }
        for (std::size_t i = 0; i < camera_rays.size(); ++i) {
            results_[i] = PathResult();
            paths_.push_back({i});
            rays_.push_back(camera_rays[i]);
        }
    }

    void trace()
    {
        for (int bounce = 0; !paths_.empty(); ++bounce) {
            hits_.resize(rays_.size());
            // Reflected rays meet what shadow rays meet: both estimate the same light.
            scene_.cast_rays(rays_, hits_, bounce == 0, bounce == 0 ? &SeenBy::camera : &SeenBy::shadow);
            if (bounce == 0)
                normalize_camera_rays();
            next_paths_.clear();
            next_rays_.clear();
            candidates_.clear();
            shadow_rays_.clear();
            for (std::size_t i = 0; i < paths_.size(); ++i) {
                if (arrive(paths_[i], rays_[i], hits_[i], bounce) && bounce < path_tracer_.max_bounces)
                    scatter(paths_[i], rays_[i], hits_[i], bounce);
            }
            add_candidates(bounce);
            paths_.swap(next_paths_);
            rays_.swap(next_rays_);
        }
    }

private:
    /// Called after the rays have been cast: a direction with another rounding might hit something else.
    void normalize_camera_rays()
    {
        for (std::size_t i = 0; i < rays_.size(); ++i) {
            const double length = glm::length(rays_[i].direction);
            rays_[i].direction /= length;
            rays_[i].t_near *= length;
            rays_[i].t_far *= length;
            hits_[i].t *= length;
        }
    }

    /// The probability of choosing a light, for the density of other rays that meet it.
    double chance() const { return 1.0 / static_cast<double>(chosen_from_.size()); }

    /// Adds light to a path that was scattered `scatterings` times.
    void add(std::size_t index, const glm::dvec3& radiance, int scatterings)
    {
        results_[index].radiance += radiance;
        if (scatterings <= 1)
            results_[index].direct += radiance;
    }

    /// Adds light that the ray itself meets; returns whether it continues to a surface.
    bool arrive(const Path& path, const Ray& ray, const Hit& hit, int bounce)
    {
        const bool from_camera = path.density == infinity;
        const Ray up_to_hit{ray.origin, ray.direction, ray.t_near, std::min(ray.t_far, hit.t / before_light)};
        std::optional<Emission> nearest;
        for (const Emitter& light : path_tracer_.lights) {
            const auto meet = [&](const auto& source) -> std::optional<Emission> {
                using Source = std::decay_t<decltype(source)>;
                if constexpr (std::is_same_v<Source, RectangleLight> || std::is_same_v<Source, SphereLight>)
                    return emission(source, up_to_hit);
                else if constexpr (std::is_same_v<Source, EnvironmentLight>)
                    return hit || (from_camera && !source.visible) ? std::nullopt
                                                                   : std::optional(emission(source, ray.direction));
                else
                    return std::nullopt;
            };
            if (const std::optional<Emission> met = std::visit(meet, light); met && !(nearest && nearest->t < met->t))
                nearest = met;
        }
        if (nearest) {
            const double weight = from_camera || nearest->density == 0.0
                                      ? 1.0
                                      : power_heuristic(path.density, chance() * nearest->density);
            add(path.index, weight * path.throughput * nearest->radiance, bounce);
        }
        if (from_camera)
            results_[path.index].covered = nearest || hit;
        return !nearest && hit && hit.normal != glm::dvec3(0.0);
    }

    void scatter(const Path& path, const Ray& ray, const Hit& hit, int bounce)
    {
        const auto found = path_tracer_.material_of_geometry.find(hit.geometry_id);
        const Material& material =
            found == path_tracer_.material_of_geometry.end() ? path_tracer_.material : found->second;
        SurfacePoint point{hit.position, hit.normal, -ray.direction, projection_.depth(hit.position)};
        lookup_.complete(point, hit, needs_curvature(material));
        if (path.density == infinity && is_unlit(material.cap_color, point)) { // seen by the camera
            add(path.index, path.throughput * albedo(material, point), bounce);
            return;
        }
        const Scattering scattering(material, point);
        const auto against_ray = [&](const glm::dvec3& normal) {
            return glm::dot(normal, ray.direction) > 0.0 ? -normal : normal;
        };
        // Normals interpolated between vertices shade the surface, but light stays on the face's side.
        const glm::dvec3 face = against_ray(hit.normal);
        const Frame frame(against_ray(point.normal));
        const glm::dvec3 to_viewer = frame.to_local(-ray.direction);
        const glm::dvec3 origin = scene_.offset_position(hit, face);
        RandomSequence& random = random_[path.index];

        // All numbers are drawn, even unused ones, so that each has the same meaning in all scenes.
        const double which_light = random.next();
        const glm::dvec2 on_light = random.next2();
        const double which_lobe = random.next();
        const glm::dvec2 in_lobe = random.next2();
        const double roulette = random.next();

        if (!chosen_from_.empty())
            ask_light(path, origin, face, frame, scattering, to_viewer, which_light, on_light);

        const std::optional<ScatterSample> scattered = scattering.sample(to_viewer, which_lobe, in_lobe);
        if (!scattered)
            return;
        const glm::dvec3 direction = frame.to_world(scattered->direction);
        if (!(glm::dot(face, direction) > 0.0))
            return;
        Path next{path.index, path.throughput * scattered->weight, scattered->density};
        if (bounce + 1 >= first_roulette) {
            const double survival = std::min(1.0, std::max({next.throughput.x, next.throughput.y, next.throughput.z}));
            if (!(roulette < survival))
                return;
            next.throughput /= survival;
        }
        next_paths_.push_back(next);
        next_rays_.push_back({origin, direction});
    }

    void ask_light(const Path& path, const glm::dvec3& origin, const glm::dvec3& face, const Frame& frame,
                   const Scattering& scattering, const glm::dvec3& to_viewer, double which_light,
                   const glm::dvec2& on_light)
    {
        const auto count = chosen_from_.size();
        const auto index = std::min(static_cast<std::size_t>(which_light * static_cast<double>(count)), count - 1);
        const auto drawn =
            std::visit([&](const auto& source) { return sample(source, origin, on_light); }, *chosen_from_[index]);
        if (!drawn || !(glm::dot(face, drawn->direction) > 0.0))
            return;
        const glm::dvec3 to_light = frame.to_local(drawn->direction);
        const glm::dvec3 f = scattering.evaluate(to_viewer, to_light);
        if (f == glm::dvec3(0.0))
            return;
        const double weight = drawn->density > 0.0
                                  ? power_heuristic(chance() * drawn->density, scattering.density(to_viewer, to_light))
                                  : 1.0;
        candidates_.push_back(
            {path.index, chosen_from_[index], path.throughput * f * drawn->weight * (to_light.z * weight / chance())});
        shadow_rays_.push_back({origin, drawn->direction, 0.0, before_light * drawn->distance});
    }

    void add_candidates(int bounce)
    {
        hidden_.resize(shadow_rays_.size());
        // Paths spread at the first bounce; the shadow rays before it are coherent.
        scene_.test_occlusions(shadow_rays_, hidden_, /*coherent=*/bounce == 0);
        for (std::size_t i = 0; i < candidates_.size(); ++i)
            if (!hidden_[i] && !is_hidden_by_light(shadow_rays_[i], candidates_[i].light))
                add(candidates_[i].index, candidates_[i].radiance, bounce + 1);
    }

    /// Lights are not in the scene, but they end rays like surfaces. No light hides itself.
    bool is_hidden_by_light(const Ray& shadow_ray, const Emitter* source) const
    {
        return std::any_of(path_tracer_.lights.begin(), path_tracer_.lights.end(), [&](const Emitter& light) {
            if (&light == source)
                return false;
            if (const auto* rectangle = std::get_if<RectangleLight>(&light))
                return emission(*rectangle, shadow_ray).has_value();
            if (const auto* sphere = std::get_if<SphereLight>(&light))
                return emission(*sphere, shadow_ray).has_value();
            return false;
        });
    }

    const SceneSnapshot& scene_;
    const SurfaceLookup lookup_;
    const PathTracer& path_tracer_;
    const Projection& projection_;
    std::span<RandomSequence> random_;
    std::span<PathResult> results_;
    std::vector<const Emitter*> chosen_from_;
    std::vector<Path> paths_, next_paths_;
    std::vector<Ray> rays_, next_rays_, shadow_rays_;
    std::vector<Hit> hits_;
    std::vector<Candidate> candidates_;
    std::vector<std::uint8_t> hidden_;
};

} // namespace

void trace_paths(const SceneSnapshot& scene, const PathTracer& path_tracer, const Projection& projection,
                 std::span<const Ray> camera_rays, std::span<RandomSequence> random, std::span<PathResult> results)
{
    PathBatch(scene, path_tracer, projection, camera_rays, random, results).trace();
}

} // namespace isospline
