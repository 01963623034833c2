#include "isospline/render/renderer.h"

#include "isospline/render/pixel_samples.h"
#include "isospline/render/projection.h"
#include "isospline/render/ray_batch.h"
#include "isospline/render/surface_lookup.h"
#include "isospline/render/visibility.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/util/error.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace isospline {

namespace {

/// Pixels along the side of a tile.
constexpr int tile_side = 16;

/// The pixel of a tile that is i-th along its Z-order curve, so that rays that follow each other are neighbours in both
/// directions and go well together in one packet.
glm::ivec2 z_order(int i)
{
    const auto even_bits = [](int bits) { return (bits & 1) | (bits & 4) >> 1 | (bits & 16) >> 2 | (bits & 64) >> 3; };
    return {even_bits(i), even_bits(i >> 1)};
}

/// One picture in the making; its tiles may be rendered in any order and by any thread.
class Renderer {
public:
    /// Without a scene there is no visibility.
    Renderer(const CastRays& cast_rays, const CompletePoint& complete_point, const SceneSnapshot* scene,
             const Camera& camera, const RenderOptions& options)
        : cast_rays_(cast_rays), complete_point_(complete_point), scene_(scene), projection_(camera, options.size),
          samples_(pixel_samples(options.samples, projection_.has_lens())), shading_(prepared(options.shading)),
          background_(options.background), tiles_((options.size + tile_side - 1) / tile_side),
          image_(options.size, options.layers)
    {
        for (const auto& [geometry_id, shading] : options.shading_of_geometry)
            shading_of_geometry_.emplace(geometry_id, prepared(shading));
        const auto any_shading = [&](const auto& is_so) {
            return is_so(shading_) || std::any_of(shading_of_geometry_.begin(), shading_of_geometry_.end(),
                                                  [&](const auto& of_geometry) { return is_so(of_geometry.second); });
        };
        visibility_is_needed_ = any_shading(Visibility::is_needed_by);
        all_opaque_ = !any_shading([](const Shading& shading) { return opacity(shading) < 1.0; });
        validate_background(background_);
        validate(options.layers);
        if (options.layers.direct)
            throw_invalid("direct", "false without a path tracer", "true");
        if (!scene_ && options.layers.ambient_occlusion > 0)
            throw_invalid("ambient_occlusion", "0, as there is no scene", options.layers.ambient_occlusion);
        if (options.layers.ambient_occlusion > 0) {
            openness_ = openness_of(shading_, options.layers.ambient_occlusion);
            for (const auto& [geometry_id, shading] : shading_of_geometry_)
                openness_of_geometry_.emplace(geometry_id, openness_of(shading, options.layers.ambient_occlusion));
        }
        image_.world_to_camera = projection_.world_to_camera();
        image_.world_to_ndc = projection_.world_to_ndc();
        image_.pixel_aspect_ratio = projection_.pixel_aspect_ratio();
    }

    std::size_t tile_count() const { return static_cast<std::size_t>(tiles_.x) * static_cast<std::size_t>(tiles_.y); }

    void render_tile(std::size_t tile);

    Image take_image() && { return std::move(image_); }

private:
    /// A shading that is checked, and that has its lights.
    Shading prepared(Shading shading) const
    {
        validate(shading);
        if (!scene_ && Visibility::is_needed_by(shading))
            throw_invalid("shading", "one without shadows and ambient occlusion, as there is no scene", "one with");
        if (!scene_ && opacity(shading) < 1.0)
            throw_invalid("opacity", "1, as there is no scene", opacity(shading));
        if (auto* phong = std::get_if<Phong>(&shading); phong && !phong->lights)
            phong->lights = camera_lights(projection_.right(), projection_.up(), projection_.forward());
        return shading;
    }

    const Shading& shading_of(const Hit& hit) const
    {
        const auto found = shading_of_geometry_.find(hit.geometry_id);
        return found == shading_of_geometry_.end() ? shading_ : found->second;
    }

    Visibility visibility_of(const RayBatch& batch, std::size_t sample) const
    {
        if (!visibility_is_needed_)
            return {};
        return {*scene_, batch, [this](const Hit& hit) -> const Shading& { return shading_of(hit); }, all_opaque_,
                static_cast<std::uint32_t>(sample)};
    }

    /// The model of Image::ambient_occlusion, as translucent as the one that is shown.
    static Shading openness_of(const Shading& shading, int samples)
    {
        AmbientOcclusion model;
        model.samples = samples;
        model.opacity = opacity(shading);
        return model;
    }

    /// What the first hits of a batch, one a ray, see of the sky.
    Visibility sky_of(RayBatch batch, std::size_t ray_count) const
    {
        batch.resize(ray_count);
        const auto model_of = [this](const Hit& hit) -> const Shading& {
            const auto found = openness_of_geometry_.find(hit.geometry_id);
            return found == openness_of_geometry_.end() ? openness_ : found->second;
        };
        return {*scene_, batch, model_of, all_opaque_, 0};
    }

    SurfacePoint point_of(const Hit& hit, const Ray& ray, bool with_curvature) const
    {
        SurfacePoint point{hit.position, hit.normal, -glm::normalize(ray.direction), projection_.depth(hit.position)};
        if (complete_point_)
            complete_point_(point, hit, with_curvature);
        return point;
    }

    void store_center(std::size_t pixel, const Hit& hit, const SurfacePoint& point);
    void store_color(std::size_t pixel, const glm::dvec4& color);

    const CastRays& cast_rays_;
    const CompletePoint& complete_point_;
    const SceneSnapshot* scene_;
    bool visibility_is_needed_ = false, all_opaque_ = true;
    Projection projection_;
    std::vector<PixelSample> samples_;
    Shading shading_;
    std::map<std::uint32_t, Shading> shading_of_geometry_;
    Shading openness_; ///< the model of Image::ambient_occlusion
    std::map<std::uint32_t, Shading> openness_of_geometry_;
    glm::vec4 background_;
    glm::ivec2 tiles_;
    Image image_;
};

void Renderer::render_tile(std::size_t tile)
{
    // The pixels of the tile that are in the image.
    const std::size_t tiles_in_row = static_cast<std::size_t>(tiles_.x);
    const glm::ivec2 first = tile_side * glm::ivec2(tile % tiles_in_row, tile / tiles_in_row);
    const glm::ivec2 size = projection_.size();
    RayBatch batch;
    for (int i = 0; i < tile_side * tile_side; ++i) {
        const glm::ivec2 pixel = first + z_order(i);
        if (pixel.x < size.x && pixel.y < size.y)
            batch.pixels.push_back(pixel);
    }
    const auto index = [&](const glm::ivec2& pixel) {
        return static_cast<std::size_t>(pixel.y) * static_cast<std::size_t>(size.x) + static_cast<std::size_t>(pixel.x);
    };

    // One batch of rays a sample; the first goes through the centres.
    const std::size_t ray_count = batch.pixels.size();
    std::vector<glm::dvec4> colors(ray_count, glm::dvec4(0.0));
    for (const PixelSample& sample : samples_) {
        batch.resize(ray_count);
        for (std::size_t i = 0; i < ray_count; ++i) {
            const glm::ivec2& pixel = batch.pixels[i];
            batch.rays[i] = projection_.ray(glm::dvec2(pixel) + sample.position, lens_position(sample, pixel));
        }
        cast_rays_(batch.rays, batch.hits);
        if (!all_opaque_)
            append_layers(batch, *scene_, [this](const Hit& hit) { return opacity(shading_of(hit)); });
        if (&sample == &samples_.front() && !image_.ambient_occlusion.empty()) {
            const Visibility sky = sky_of(batch, ray_count);
            for (std::size_t i = 0; i < ray_count; ++i)
                if (batch.hits[i])
                    image_.ambient_occlusion[index(batch.pixels[i])] = static_cast<float>(sky.openness(i));
        }
        const Visibility visibility = visibility_of(batch, static_cast<std::size_t>(&sample - &samples_.front()));
        for (std::size_t i = 0; i < ray_count; ++i) {
            if (!batch.hits[i])
                continue;
            // Front to back, each layer over those behind it.
            glm::dvec3 color(0.0);
            double transmittance = 1.0;
            const auto add_layer = [&](std::size_t layer) {
                const Hit& hit = batch.hits[layer];
                const Shading& shading = shading_of(hit);
                const bool central = layer == i && &sample == &samples_.front();
                const bool with_curvature = (central && !image_.curvature.empty()) || needs_curvature(shading);
                SurfacePoint point = point_of(hit, batch.rays[layer], with_curvature);
                point.lit = visibility.lit(layer);
                point.openness = visibility.openness(layer);
                if (central)
                    store_center(index(batch.pixels[i]), hit, point);
                if (sample.weight > 0.0)
                    color += transmittance * opacity(shading) * shade(shading, point);
                transmittance *= 1.0 - opacity(shading);
            };
            add_layer(i);
            if (!batch.behind.empty())
                for (std::size_t layer = batch.behind[i]; layer < batch.behind[i + 1]; ++layer)
                    add_layer(layer);
            colors[i] += sample.weight * glm::dvec4(color, 1.0 - transmittance);
        }
    }

    for (std::size_t i = 0; i < ray_count; ++i)
        store_color(index(batch.pixels[i]), colors[i]);
}

void Renderer::store_center(std::size_t pixel, const Hit& hit, const SurfacePoint& point)
{
    image_.depth[pixel] = static_cast<float>(point.depth);
    image_.position[pixel] = glm::vec3(point.position);
    image_.normal[pixel] = glm::vec3(point.normal);
    image_.albedo[pixel] = glm::vec3(albedo(shading_of(hit), point));
    image_.gradient_magnitude[pixel] = static_cast<float>(hit.gradient_magnitude);
    if (!image_.curvature.empty())
        image_.curvature[pixel] = glm::vec2(point.curvature.mean, point.curvature.gaussian);
    image_.geometry_ids[pixel] = hit.geometry_id;
    image_.primitive_ids[pixel] = hit.primitive_id;
}

void Renderer::store_color(std::size_t pixel, const glm::dvec4& color)
{
    // Sums of weights may miss 1 by rounding.
    const double coverage = std::abs(color.a - 1.0) < 1e-9 ? 1.0 : color.a;
    const double behind = (1.0 - coverage) * background_.a;
    image_.color[pixel] = glm::vec4(glm::dvec3(color) + behind * glm::dvec3(background_), coverage + behind);
}

Image render(const CastRays& cast_rays, const CompletePoint& complete_point, const SceneSnapshot* scene,
             const Camera& camera, const RenderOptions& options, const Progress& progress)
{
    Renderer renderer(cast_rays, complete_point, scene, camera, options);
    parallel_for(
        renderer.tile_count(), 1,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t tile = begin; tile < end; ++tile)
                renderer.render_tile(tile);
        },
        progress);
    return std::move(renderer).take_image();
}

} // namespace

void validate_background(const glm::vec4& background)
{
    for (int part = 0; part < 4; ++part)
        if (!(std::isfinite(background[part]) && background[part] >= 0.0f))
            throw_invalid("background", "finite numbers of at least 0", background[part]);
    if (background.a > 1.0f)
        throw_invalid("background", "an opacity of at most 1", background.a);
}

void validate(const Layers& layers)
{
    if (layers.ambient_occlusion < 0 || layers.ambient_occlusion > 65536)
        throw_invalid("ambient_occlusion", "rays a hit, from 0 to 65536", layers.ambient_occlusion);
}

Image render(const CastRays& cast_rays, const Camera& camera, const RenderOptions& options, const Progress& progress,
             const CompletePoint& complete_point)
{
    return render(cast_rays, complete_point, nullptr, camera, options, progress);
}

Image render(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options, const Progress& progress)
{
    const CastRays cast_rays = [&scene](std::span<const Ray> rays, std::span<Hit> hits) {
        scene.cast_rays(rays, hits, true);
    };
    const SurfaceLookup lookup(scene);
    const CompletePoint complete_point = [&lookup](SurfacePoint& point, const Hit& hit, bool with_curvature) {
        lookup.complete(point, hit, with_curvature);
    };
    for (const auto& [geometry_id, shading] : options.shading_of_geometry)
        if (!scene.contains(geometry_id))
            throw_invalid("shading", "geometry ids of objects in the scene", geometry_id);
    RenderOptions fitted = options;
    const glm::dvec2 depths = Projection(camera, options.size).depth_range(scene.bounds());
    fit_depth_limits(fitted.shading, depths);
    for (auto& [geometry_id, shading] : fitted.shading_of_geometry)
        fit_depth_limits(shading, depths);
    return render(cast_rays, complete_point, &scene, camera, fitted, progress);
}

} // namespace isospline
