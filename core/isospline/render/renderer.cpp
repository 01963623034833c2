#include "isospline/render/renderer.h"

#include "isospline/render/appearances.h"
#include "isospline/render/pixel_samples.h"
#include "isospline/render/projection.h"
#include "isospline/render/ray_batch.h"
#include "isospline/render/surface_lookup.h"
#include "isospline/render/tiles.h"
#include "isospline/render/visibility.h"
#include "isospline/scene/ray_caster.h"
#include "isospline/scene/scene_certifier.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/util/error.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace isospline {

namespace {

/// Rays of a tile that are traced together, about as many as stay in the cache with their hits.
constexpr std::size_t rays_of_batch = 1024;

/// The memory of one thread that renders tile after tile.
struct Workspace {
    explicit Workspace(const SceneSnapshot& scene) : caster(scene, RayCaster::Rays::coherent) {}

    RayCaster caster;
    std::vector<glm::ivec2> pixels; ///< of a tile
    RayBatch batch;
    std::vector<RayCertificate> proven;                    ///< of a batch's rays
    std::vector<glm::dvec3> colors_of_hits;                ///< of a batch
    std::vector<std::vector<glm::dvec4>> colors_of_pixels; ///< of the tile in each look, premultiplied
    PhongPoints points;
    PhongColors colors_of_points;
};

/// A picture in progress; its tiles may be rendered in any order and by any thread.
class Renderer {
public:
    /// `given` are the images of all looks; without any, there are new ones. `fragments` are filled as well, if they
    /// are not null.
    Renderer(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options,
             std::span<const Look> further, Fragments* fragments, std::span<Image* const> given = {})
        : scene_(scene), lookup_(scene), projection_(camera, options.size),
          window_(rendered_window(options.crop, options.size)), layers_(options.layers),
          samples_(pixel_samples(options.samples, projection_.has_lens())), background_(options.background),
          tone_(options.tone), shadow_rays_(options.shadow_rays), step_(checked_step(options.step)),
          position_origin_(options.positions_from_eye ? projection_.eye() : glm::dvec3(0.0)),
          tiles_(window_.size, options.mask, step_, glm::ivec2((step_ - window_.first % step_) % step_)),
          fragments_(fragments), images_(given.begin(), given.end())
    {
        validate(options, fragments != nullptr);
        if (layers_.certified)
            certifier_.emplace(scene, &SeenBy::camera, "layers");
        const DepthRange depths = [&] {
            if (fragments)
                throw_invalid("shading", "limits of ColorByDepth for parts of a scene", "none");
            return projection_.depth_range(scene.bounds());
        };
        looks_.emplace_back(scene, options, projection_, depths);
        for (const Look& look : further)
            looks_.emplace_back(scene, look, projection_, depths);
        if (!looks_[0].all_opaque())
            absorption_.emplace(
                scene, [this](std::uint32_t id) { return looks_[0].of(id).even_opacity; }, opacities());
        new_images_.reserve(looks_.size());
        while (images_.size() < looks_.size()) {
            const Layers layers = images_.empty() ? layers_ : Layers();
            new_images_.push_back(blank_image(projection_, window_, layers, options.encoding));
            images_.push_back(&new_images_.back());
        }
        if (fragments)
            prepare_fragments();
    }

    std::size_t tile_count() const { return tiles_.count(); }

    void render_tile(std::size_t tile, Workspace& workspace);

    /// Ends the images; returns the new ones.
    std::vector<Image> take_images() &&
    {
        for (Image& image : new_images_)
            image.covered_count = covered_count_;
        return std::move(new_images_);
    }

private:
    SurfacePoint point_of(const Hit& hit, const Ray& ray, bool with_curvature) const
    {
        SurfacePoint point{hit.position, hit.normal, -glm::normalize(ray.direction), projection_.depth(hit.position)};
        lookup_.complete(point, hit, with_curvature);
        return point;
    }

    double opacity_of(const Hit& hit, const Ray& ray) const
    {
        const Appearance& appearance = looks_[0].of(hit.geometry_id);
        return appearance.even_opacity ? *appearance.even_opacity
                                       : opacity(appearance.shading, point_of(hit, ray, false));
    }

    OpacityOf opacities() const
    {
        return [this](const Hit& hit, const Ray& ray) { return opacity_of(hit, ray); };
    }

    std::size_t fragment(std::size_t sample, const glm::ivec2& pixel) const
    {
        return sample * images_[0]->pixel_count() + window_.number(pixel);
    }

    void prepare_fragments();
    void find_hits(std::size_t first_sample, std::size_t sample_count, Workspace& workspace);
    void add_colors(std::size_t sample_count, const Workspace& workspace, std::vector<glm::dvec4>& colors);
    void store_openness(RayBatch batch);
    void store_layers(Workspace& workspace);
    void shade_hits(const Appearances& look, Workspace& workspace) const;
    glm::dvec4 color_of_ray(const Workspace& workspace, std::size_t ray) const;
    void store_color(Image& image, std::size_t pixel, const glm::dvec4& color);

    const SceneSnapshot& scene_;
    SurfaceLookup lookup_;
    Projection projection_;
    Window window_;
    Layers layers_;
    std::vector<PixelSample> samples_;
    std::vector<Appearances> looks_;       ///< the first decides opacities and layers
    std::optional<Absorption> absorption_; ///< unless all surfaces are opaque
    glm::vec4 background_;
    std::optional<ToneCurve> tone_;
    ShadowRays shadow_rays_;
    int step_;
    glm::dvec3 position_origin_; ///< of the layer
    Tiles tiles_;                ///< of the window
    Fragments* fragments_;
    std::vector<Image> new_images_;
    std::vector<Image*> images_;              ///< in each look
    std::optional<SceneCertifier> certifier_; ///< for the layer
    std::atomic<std::size_t> covered_count_ = 0;
};

void Renderer::render_tile(std::size_t tile, Workspace& workspace)
{
    std::vector<glm::ivec2>& pixels = workspace.pixels;
    tiles_.get_pixels(tile, pixels);
    if (pixels.empty())
        return;
    for (glm::ivec2& pixel : pixels)
        pixel += window_.first;
    workspace.colors_of_pixels.resize(looks_.size());
    for (std::vector<glm::dvec4>& colors : workspace.colors_of_pixels)
        colors.assign(pixels.size(), glm::dvec4(0.0));

    // The first sample goes through the centres, and may be for the layers only. The rays of other samples of a pixel
    // are near to each other, and are traced together.
    const std::size_t most = std::max<std::size_t>(1, rays_of_batch / pixels.size());
    for (std::size_t first = 0, count = 1; first < samples_.size(); first += count) {
        if (first > 0)
            count = std::min(most, samples_.size() - first);
        const bool for_layers = first == 0 && layers_.any_of_centers();
        const bool for_color = samples_[first].weight != 0.0;
        if (!for_layers && !for_color)
            continue;
        find_hits(first, count, workspace);
        if (for_layers)
            store_layers(workspace);
        for (std::size_t look = 0; for_color && look < looks_.size(); ++look) {
            shade_hits(looks_[look], workspace);
            add_colors(count, workspace, workspace.colors_of_pixels[look]);
        }
    }

    std::size_t covered_count = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        for (std::size_t look = 0; look < looks_.size(); ++look)
            store_color(*images_[look], window_.number(pixels[i]), workspace.colors_of_pixels[look][i]);
        covered_count += workspace.colors_of_pixels[0][i].a > 0.0;
    }
    covered_count_ += covered_count;
}

/// The hits of some samples of a tile.
void Renderer::find_hits(std::size_t first_sample, std::size_t sample_count, Workspace& workspace)
{
    RayBatch& batch = workspace.batch;
    batch.begin(workspace.pixels, first_sample, sample_count);
    for (std::size_t i = 0; i < batch.rays.size(); ++i) {
        const glm::ivec2& pixel = batch.pixels[i];
        const PixelSample& sample = samples_[batch.samples[i]];
        batch.rays[i] = projection_.ray(glm::dvec2(pixel) + sample.position, lens_position(sample, pixel));
    }
    if (absorption_)
        find_hits_through(batch, workspace.caster, *absorption_, opacities());
    else
        workspace.caster.cast(batch.rays, batch.hits);
    for (std::size_t i = 0; fragments_ && i < batch.hits.size(); ++i)
        fragments_->set_hit(fragment(batch.samples[i], batch.pixels[i]), batch.hits[i]);
}

/// Adds the colours of a batch to those of a tile's pixels.
void Renderer::add_colors(std::size_t sample_count, const Workspace& workspace, std::vector<glm::dvec4>& colors)
{
    const RayBatch& batch = workspace.batch;
    for (std::size_t i = 0; i < batch.pixels.size(); ++i) {
        if (!batch.hits[i])
            continue;
        const glm::dvec4 color = color_of_ray(workspace, i);
        colors[i / sample_count] += samples_[batch.samples[i]].weight * color;
        if (fragments_)
            fragments_->colors[fragment(batch.samples[i], batch.pixels[i])] = glm::dvec3(color);
    }
}

/// The layers of a batch of one sample.
void Renderer::store_layers(Workspace& workspace)
{
    const RayBatch& batch = workspace.batch;
    const std::size_t ray_count = batch.pixels.size();
    if (layers_.ambient_occlusion)
        store_openness(batch);
    if (certifier_)
        certifier_->certify(std::span(batch.rays).first(ray_count), batch.hits, workspace.proven);
    for (std::size_t i = 0; i < ray_count; ++i) {
        const std::size_t pixel = window_.number(batch.pixels[i]);
        if (certifier_)
            images_[0]->certified[pixel] = static_cast<std::uint32_t>(workspace.proven[i].status);
        const Hit& hit = batch.hits[i];
        if (!hit)
            continue;
        const Appearance& appearance = looks_[0].of(hit.geometry_id);
        const SurfacePoint point = point_of(hit, batch.rays[i], layers_.curvature || appearance.needs_curvature);
        set_layers(*images_[0], pixel, layers_, hit, point, appearance.shading, position_origin_);
    }
}

/// The colours of all hits of a batch; hits with Phong's model and without shadows are shaded in SIMD lanes.
void Renderer::shade_hits(const Appearances& look, Workspace& workspace) const
{
    RayBatch& batch = workspace.batch;
    const auto shading_at = [&](const Hit& hit, const Ray& ray) {
        const glm::dvec3 normal = lookup_.is_plain(hit) ? hit.normal : point_of(hit, ray, false).normal;
        return std::pair(&look.of(hit.geometry_id).shading, normal);
    };
    const Visibility visibility = look.needs_visibility()
                                      ? Visibility(scene_, batch, shading_at, absorption_, shadow_rays_, step_)
                                      : Visibility();
    workspace.colors_of_hits.resize(batch.hits.size());
    const Phong* model = nullptr;
    std::array<std::size_t, PhongPoints::capacity> hit_of_point;
    PhongPoints& points = workspace.points;
    points.count = 0;
    const auto shade_points = [&] {
        if (points.count == 0)
            return;
        shade(*model, points, workspace.colors_of_points);
        const auto& [red, green, blue] = workspace.colors_of_points.part;
        for (std::size_t point = 0; point < points.count; ++point)
            workspace.colors_of_hits[hit_of_point[point]] = {red[point], green[point], blue[point]};
        points.count = 0;
    };
    for (std::size_t i = 0; i < batch.hits.size(); ++i) {
        const Hit& hit = batch.hits[i];
        if (!hit)
            continue;
        const Appearance& appearance = look.of(hit.geometry_id);
        const auto* const phong = std::get_if<Phong>(&appearance.shading);
        const auto* const constant = phong ? std::get_if<glm::dvec3>(&phong->color) : nullptr;
        if (look.needs_visibility() || !constant || !lookup_.is_plain(hit)) {
            SurfacePoint point = point_of(hit, batch.rays[i], appearance.needs_curvature);
            if (look.needs_visibility()) {
                point.lit = visibility.lit(i);
                point.openness = visibility.openness(i);
            }
            workspace.colors_of_hits[i] = shade(appearance.shading, point);
            continue;
        }
        if (phong != model || points.count == PhongPoints::capacity)
            shade_points();
        model = phong;
        hit_of_point[points.count] = i;
        points.set(points.count++, hit.position, hit.normal, batch.rays[i].direction, *constant);
    }
    shade_points();
}

/// The composited colour of a ray's hits, each surface over those behind it: premultiplied colour, and coverage.
glm::dvec4 Renderer::color_of_ray(const Workspace& workspace, std::size_t ray) const
{
    const RayBatch& batch = workspace.batch;
    if (batch.weights.empty())
        return {workspace.colors_of_hits[ray], 1.0};
    glm::dvec4 sum(0.0);
    const auto add = [&](std::size_t i) { sum += batch.weights[i] * glm::dvec4(workspace.colors_of_hits[i], 1.0); };
    add(ray);
    for (std::size_t i = batch.behind[ray]; i < batch.behind[ray + 1]; ++i)
        add(i);
    return sum;
}

void Renderer::prepare_fragments()
{
    if (absorption_ || looks_[0].needs_visibility() || layers_.ambient_occlusion)
        throw_invalid("shading", "opaque surfaces without shadows and ambient occlusion for parts of a scene",
                      !absorption_ ? "another that casts shadow rays" : "an opacity below 1");
    *fragments_ = Fragments(samples_, images_[0]->pixel_count());
}

/// The openness to the sky of the first hits of a batch of one sample.
void Renderer::store_openness(RayBatch batch)
{
    batch.drop_behind();
    AmbientOcclusion openness;
    openness.samples = layers_.ambient_occlusion_samples;
    const Shading shading = openness;
    const Visibility sky(
        scene_, batch, [&](const Hit& hit, const Ray&) { return std::pair(&shading, hit.normal); }, absorption_);
    for (std::size_t i = 0; i < batch.hits.size(); ++i)
        if (batch.hits[i])
            images_[0]->ambient_occlusion[window_.number(batch.pixels[i])] = static_cast<float>(sky.openness(i));
}

void Renderer::store_color(Image& image, std::size_t pixel, const glm::dvec4& color)
{
    // Sums of weights may differ from 1 by rounding.
    const double coverage = std::abs(color.a - 1.0) < 1e-9 ? 1.0 : color.a;
    const double behind = (1.0 - coverage) * background_.a;
    glm::dvec3 surfaces(color);
    if (tone_ && coverage > 0.0)
        surfaces = coverage * tone_mapped(surfaces / coverage, *tone_);
    image.set_color(pixel, glm::vec4(surfaces + behind * glm::dvec3(background_), coverage + behind));
}

std::vector<Image> render(const SceneSnapshot& scene, Renderer&& renderer, const Progress& progress)
{
    std::mutex mutex;
    std::vector<std::unique_ptr<Workspace>> idle;
    const auto take = [&]() -> std::unique_ptr<Workspace> {
        const std::lock_guard lock(mutex);
        if (idle.empty())
            return nullptr;
        std::unique_ptr<Workspace> workspace = std::move(idle.back());
        idle.pop_back();
        return workspace;
    };
    parallel_for(
        renderer.tile_count(), 1,
        [&](std::size_t begin, std::size_t end) {
            std::unique_ptr<Workspace> workspace = take();
            if (!workspace)
                workspace = std::make_unique<Workspace>(scene);
            for (std::size_t tile = begin; tile < end; ++tile)
                renderer.render_tile(tile, *workspace);
            const std::lock_guard lock(mutex);
            idle.push_back(std::move(workspace));
        },
        progress);
    return std::move(renderer).take_images();
}

} // namespace

Image render(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options, const Progress& progress)
{
    return std::move(render_looks(scene, camera, options, {}, progress)[0]);
}

std::vector<Image> render_looks(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options,
                                std::span<const Look> further, const Progress& progress)
{
    return render(scene, Renderer(scene, camera, options, further, nullptr), progress);
}

void render_again(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options,
                  std::span<const Look> further, std::span<Image* const> images, const Progress& progress)
{
    validate_again(options, further.size() + 1, images);
    render(scene, Renderer(scene, camera, options, further, nullptr, images), progress);
}

Image render_part(const SceneSnapshot& scene, const Camera& camera, const RenderOptions& options, Fragments& fragments,
                  const Progress& progress)
{
    return std::move(render(scene, Renderer(scene, camera, options, {}, &fragments), progress)[0]);
}

} // namespace isospline
