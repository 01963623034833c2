#include "isospline/render/renderer.h"

#include "isospline/render/pixel_samples.h"
#include "isospline/render/projection.h"
#include "isospline/render/ray_batch.h"
#include "isospline/render/surface_lookup.h"
#include "isospline/render/visibility.h"
#include "isospline/scene/ray_caster.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/util/error.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>

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

/// A shading that is checked and has its lights, and what is asked about it at every hit.
struct Appearance {
    Shading shading;
    double opacity;
    bool needs_curvature;
    Shading openness; ///< the model of Image::ambient_occlusion, as translucent as the one that is shown
};

/// What one thread needs while it renders tile after tile.
struct Workspace {
    explicit Workspace(const SceneSnapshot& scene) : caster(scene, RayCaster::Rays::coherent) {}

    RayCaster caster;
    RayBatch batch;
    std::vector<glm::dvec4> colors; ///< of the pixels of a tile, premultiplied
};

/// One picture in the making; its tiles may be rendered in any order and by any thread.
class Renderer {
public:
    Renderer(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options)
        : scene_(scene), lookup_(scene), projection_(camera, options.size), layers_(options.layers),
          samples_(pixel_samples(options.samples, projection_.has_lens())), background_(options.background),
          tiles_((options.size + tile_side - 1) / tile_side)
    {
        validate_background(background_);
        validate(layers_);
        if (layers_.direct || layers_.variance)
            throw_invalid("layers", "direct and variance of path traced pictures only",
                          layers_.direct ? "direct of another" : "variance of another");

        const DepthRange depths = [&] { return projection_.depth_range(scene.bounds()); };
        appearance_ = prepared(options.shading, depths);
        for (const auto& [geometry_id, shading] : options.shading_of_geometry) {
            if (!scene.contains(geometry_id))
                throw_invalid("shading", "geometry ids of objects in the scene", geometry_id);
            appearance_of_geometry_.emplace(geometry_id, prepared(shading, depths));
        }
        image_ = blank_image(projection_, layers_, options.encoding);
    }

    std::size_t tile_count() const { return static_cast<std::size_t>(tiles_.x) * static_cast<std::size_t>(tiles_.y); }

    void render_tile(std::size_t tile, Workspace& workspace);

    Image take_image() &&
    {
        image_.covered_count = covered_count_;
        return std::move(image_);
    }

private:
    Appearance prepared(Shading shading, const DepthRange& depths)
    {
        validate(shading);
        fit_depth_limits(shading, depths);
        if (auto* phong = std::get_if<Phong>(&shading); phong && !phong->lights)
            phong->lights = camera_lights(projection_.right(), projection_.up(), projection_.forward());
        needs_visibility_ = needs_visibility_ || Visibility::is_needed_by(shading);
        AmbientOcclusion openness;
        openness.samples = layers_.ambient_occlusion_samples;
        openness.opacity = opacity(shading);
        all_opaque_ = all_opaque_ && openness.opacity == 1.0;
        return {shading, openness.opacity, needs_curvature(shading), openness};
    }

    const Appearance& appearance_of(const Hit& hit) const
    {
        const auto found = appearance_of_geometry_.find(hit.geometry_id);
        return found == appearance_of_geometry_.end() ? appearance_ : found->second;
    }

    std::size_t index(const glm::ivec2& pixel) const
    {
        return static_cast<std::size_t>(pixel.y) * static_cast<std::size_t>(projection_.size().x) +
               static_cast<std::size_t>(pixel.x);
    }

    SurfacePoint point_of(const Hit& hit, const Ray& ray, bool with_curvature) const
    {
        SurfacePoint point{hit.position, hit.normal, -glm::normalize(ray.direction), projection_.depth(hit.position)};
        lookup_.complete(point, hit, with_curvature);
        return point;
    }

    void store_openness(RayBatch batch, std::size_t ray_count);
    glm::dvec4 color_of(const RayBatch& batch, std::size_t ray, const Visibility& visibility) const;
    void store_layers(std::size_t pixel, const Hit& hit, const Ray& ray);
    void store_color(std::size_t pixel, const glm::dvec4& color);

    const SceneSnapshot& scene_;
    SurfaceLookup lookup_;
    Projection projection_;
    Layers layers_;
    std::vector<PixelSample> samples_;
    bool needs_visibility_ = false, all_opaque_ = true;
    Appearance appearance_;
    std::map<std::uint32_t, Appearance> appearance_of_geometry_;
    glm::vec4 background_;
    glm::ivec2 tiles_;
    Image image_;
    std::atomic<std::size_t> covered_count_ = 0;
};

void Renderer::render_tile(std::size_t tile, Workspace& workspace)
{
    // The pixels of the tile that are in the image.
    const std::size_t tiles_in_row = static_cast<std::size_t>(tiles_.x);
    const glm::ivec2 first = tile_side * glm::ivec2(tile % tiles_in_row, tile / tiles_in_row);
    const glm::ivec2 size = projection_.size();
    RayBatch& batch = workspace.batch;
    batch.pixels.clear();
    for (int i = 0; i < tile_side * tile_side; ++i) {
        const glm::ivec2 pixel = first + z_order(i);
        if (pixel.x < size.x && pixel.y < size.y)
            batch.pixels.push_back(pixel);
    }

    // One batch of rays a sample; the first goes through the centres, and may be for the layers alone.
    const std::size_t ray_count = batch.pixels.size();
    workspace.colors.assign(ray_count, glm::dvec4(0.0));
    for (std::size_t number = 0; number < samples_.size(); ++number) {
        const PixelSample& sample = samples_[number];
        const bool for_layers = number == 0 && layers_.any_of_centers();
        if (sample.weight == 0.0 && !for_layers)
            continue;
        batch.resize(ray_count);
        for (std::size_t i = 0; i < ray_count; ++i) {
            const glm::ivec2& pixel = batch.pixels[i];
            batch.rays[i] = projection_.ray(glm::dvec2(pixel) + sample.position, lens_position(sample, pixel));
        }
        workspace.caster.cast(batch.rays, batch.hits);
        if (!all_opaque_)
            append_hits_behind(batch, scene_, [this](const Hit& hit) { return appearance_of(hit).opacity; });

        if (for_layers) {
            if (layers_.ambient_occlusion)
                store_openness(batch, ray_count);
            for (std::size_t i = 0; i < ray_count; ++i)
                if (batch.hits[i])
                    store_layers(index(batch.pixels[i]), batch.hits[i], batch.rays[i]);
        }
        if (sample.weight == 0.0)
            continue;
        Visibility visibility;
        if (needs_visibility_)
            visibility = {scene_, batch,
                          [this](const Hit& hit) -> const Shading& { return appearance_of(hit).shading; }, all_opaque_,
                          static_cast<std::uint32_t>(number)};
        for (std::size_t i = 0; i < ray_count; ++i)
            if (batch.hits[i])
                workspace.colors[i] += sample.weight * color_of(batch, i, visibility);
    }

    std::size_t covered_count = 0;
    for (std::size_t i = 0; i < ray_count; ++i) {
        store_color(index(batch.pixels[i]), workspace.colors[i]);
        covered_count += workspace.colors[i].a > 0.0;
    }
    covered_count_ += covered_count;
}

/// What a ray sees, front to back, each surface over those behind it: premultiplied colour, and coverage.
glm::dvec4 Renderer::color_of(const RayBatch& batch, std::size_t ray, const Visibility& visibility) const
{
    glm::dvec3 color(0.0);
    double transmittance = 1.0;
    const auto add = [&](std::size_t i) {
        const Hit& hit = batch.hits[i];
        const Appearance& appearance = appearance_of(hit);
        SurfacePoint point = point_of(hit, batch.rays[i], appearance.needs_curvature);
        if (needs_visibility_) {
            point.lit = visibility.lit(i);
            point.openness = visibility.openness(i);
        }
        color += transmittance * appearance.opacity * shade(appearance.shading, point);
        transmittance *= 1.0 - appearance.opacity;
    };
    add(ray);
    if (!batch.behind.empty())
        for (std::size_t i = batch.behind[ray]; i < batch.behind[ray + 1]; ++i)
            add(i);
    return {color, 1.0 - transmittance};
}

/// How much the first hits of a batch, one a ray, see of the sky.
void Renderer::store_openness(RayBatch batch, std::size_t ray_count)
{
    batch.resize(ray_count);
    const Visibility sky(
        scene_, batch, [this](const Hit& hit) -> const Shading& { return appearance_of(hit).openness; }, all_opaque_,
        0);
    for (std::size_t i = 0; i < ray_count; ++i)
        if (batch.hits[i])
            image_.ambient_occlusion[index(batch.pixels[i])] = static_cast<float>(sky.openness(i));
}

void Renderer::store_layers(std::size_t pixel, const Hit& hit, const Ray& ray)
{
    const SurfacePoint point = point_of(hit, ray, layers_.curvature || appearance_of(hit).needs_curvature);
    if (layers_.depth)
        image_.depth[pixel] = static_cast<float>(point.depth);
    if (layers_.position)
        image_.position[pixel] = glm::vec3(point.position);
    if (layers_.normal)
        image_.normal[pixel] = glm::vec3(point.normal);
    if (layers_.albedo)
        image_.albedo[pixel] = glm::vec3(albedo(appearance_of(hit).shading, point));
    if (layers_.gradient_magnitude)
        image_.gradient_magnitude[pixel] = static_cast<float>(hit.gradient_magnitude);
    if (layers_.curvature)
        image_.curvature[pixel] = glm::vec2(point.curvature.mean, point.curvature.gaussian);
    if (layers_.geometry_ids)
        image_.geometry_ids[pixel] = hit.geometry_id;
    if (layers_.primitive_ids)
        image_.primitive_ids[pixel] = hit.primitive_id;
}

void Renderer::store_color(std::size_t pixel, const glm::dvec4& color)
{
    // Sums of weights may miss 1 by rounding.
    const double coverage = std::abs(color.a - 1.0) < 1e-9 ? 1.0 : color.a;
    const double behind = (1.0 - coverage) * background_.a;
    image_.set_color(pixel, glm::vec4(glm::dvec3(color) + behind * glm::dvec3(background_), coverage + behind));
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
    if (layers.ambient_occlusion_samples < 1 || layers.ambient_occlusion_samples > 65536)
        throw_invalid("ambient_occlusion_samples", "rays a hit, from 1 to 65536", layers.ambient_occlusion_samples);
}

Image blank_image(const Projection& projection, const Layers& layers, ColorEncoding encoding)
{
    Image image(projection.size(), layers, encoding);
    image.world_to_camera = projection.world_to_camera();
    image.world_to_ndc = projection.world_to_ndc();
    image.pixel_aspect_ratio = projection.pixel_aspect_ratio();
    return image;
}

Image render(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options, const Progress& progress)
{
    Renderer renderer(scene, camera, options);
    // Tiles of a single sample take less time than to make a workspace for each would be worth.
    const std::size_t grain = options.samples == 1 ? 4 : 1;
    parallel_for(
        renderer.tile_count(), grain,
        [&](std::size_t begin, std::size_t end) {
            Workspace workspace(scene);
            for (std::size_t tile = begin; tile < end; ++tile)
                renderer.render_tile(tile, workspace);
        },
        progress);
    return std::move(renderer).take_image();
}

} // namespace isospline
