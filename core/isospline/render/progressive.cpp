#include "isospline/render/progressive.h"

#include "isospline/math/frame.h"
#include "isospline/render/path_batch.h"
#include "isospline/render/renderer.h"
#include "isospline/render/tiles.h"
#include "isospline/scene/scene.h"
#include "isospline/util/error.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

namespace isospline {

namespace {

/// What of a material a picture of the centres shows: its colour, as albedo.
Phong unlit(const Material& material)
{
    Phong phong;
    phong.color = material.base_color;
    phong.cap_color = material.cap_color;
    phong.lights.emplace();
    return phong;
}

RenderOptions centers_only(const PathTracer& path_tracer, glm::ivec2 size, const glm::vec4& background,
                           const Layers& layers)
{
    RenderOptions options;
    options.size = size;
    options.shading = unlit(path_tracer.material);
    for (const auto& [geometry_id, material] : path_tracer.material_of_geometry)
        options.shading_of_geometry.emplace(geometry_id, unlit(material));
    options.background = background;
    options.layers = layers;
    options.layers.direct = options.layers.variance = false;
    return options;
}

/// A path tracer with a material for every object of a scene, and with depths that fit to it.
PathTracer prepared(PathTracer path_tracer, const SceneSnapshot& scene, const Projection& projection)
{
    for (const auto& [geometry_id, material] : path_tracer.material_of_geometry)
        if (!scene.contains(geometry_id))
            throw_invalid("materials", "geometry ids of objects in the scene", geometry_id);
    for (const std::uint32_t geometry_id : scene.ids()) {
        const auto material =
            std::visit([](const auto& object) { return object->material(); }, scene.object(geometry_id).object);
        if (material)
            path_tracer.material_of_geometry.emplace(geometry_id, *material);
    }
    validate(path_tracer);

    const DepthRange depths = [&] { return projection.depth_range(scene.bounds()); };
    fit_depth_limits(path_tracer.material, depths);
    for (auto& [geometry_id, material] : path_tracer.material_of_geometry)
        fit_depth_limits(material, depths);
    return path_tracer;
}

} // namespace

ProgressiveRenderer::ProgressiveRenderer(Scene& scene, const Camera& camera, glm::ivec2 size, PathTracer path_tracer,
                                         glm::vec4 background, const Layers& layers)
    : scene_(scene), camera_(camera), projection_(camera, size), path_tracer_(std::move(path_tracer)),
      background_(background), layers_(layers)
{
    validate(path_tracer_);
    validate_background(background);
    validate(layers);
    reset();
}

void ProgressiveRenderer::reset(const Camera& camera)
{
    projection_ = Projection(camera, projection_.size());
    camera_ = camera;
    reset();
}

void ProgressiveRenderer::reset()
{
    centers_ = blank_image(projection_, layers_);
    has_centers_ = false;
    snapshot_.reset();
    sums_.assign(centers_.pixel_count(), Sum());
    directs_.assign(layers_.direct ? sums_.size() : 0, glm::dvec3(0.0));
    tile_samples_.assign(Tiles(projection_.size()).count(), 0);
    through_centers_ = false;
}

int ProgressiveRenderer::samples() const
{
    return *std::min_element(tile_samples_.begin(), tile_samples_.end());
}

void ProgressiveRenderer::step(int samples, const Progress& progress)
{
    if (samples < 1)
        throw_invalid("samples", "a number of at least 1", samples);
    if (const int left = std::numeric_limits<int>::max() - this->samples(); samples > left)
        throw_invalid("samples", "at most " + std::to_string(left) + " more", samples);
    const int wanted = this->samples() + samples;
    if (!has_centers_)
        begin(part_of(progress, 0.0, 0.05));
    else if (!scene_.is_current(*snapshot_))
        throw std::logic_error("the scene has changed since the first step: reset() the renderer before the next");

    // A picture of one sample shows what its ids tell. Samples of more are anywhere in the pixel, and that one is none
    // of them.
    if (const bool through_centers = wanted == 1; through_centers != through_centers_) {
        through_centers_ = through_centers;
        sums_.assign(sums_.size(), Sum());
        directs_.assign(directs_.size(), glm::dvec3(0.0));
        tile_samples_.assign(tile_samples_.size(), 0);
    }

    // Sample by sample, so that all of the picture is equally good wherever it is cancelled.
    const Progress of_samples = part_of(progress, 0.05, 1.0);
    const int first = this->samples(), count = wanted - first;
    for (int done = 0; done < count; ++done)
        parallel_for(
            tile_samples_.size(), 1,
            [&](std::size_t begin, std::size_t end) {
                for (std::size_t tile = begin; tile < end; ++tile)
                    render_tile(tile, first + done + 1);
            },
            part_of(of_samples, static_cast<double>(done) / count, static_cast<double>(done + 1) / count));
}

void ProgressiveRenderer::begin(const Progress& progress)
{
    snapshot_ = scene_.snapshot(part_of(progress, 0.0, 0.5));
    prepared_ = prepared(path_tracer_, *snapshot_, projection_);
    if (layers_.any_of_centers())
        centers_ = render(*snapshot_, camera_, centers_only(prepared_, projection_.size(), background_, layers_),
                          part_of(progress, 0.5, 1.0));
    for (glm::vec3& albedo : centers_.albedo)
        albedo = glm::min(albedo, 1.0f);
    has_centers_ = true;
}

void ProgressiveRenderer::render_tile(std::size_t tile, int samples)
{
    const glm::ivec2 size = projection_.size();
    std::vector<glm::ivec2> pixels;
    Tiles(size).get_pixels(tile, pixels);
    std::vector<Ray> rays;
    std::vector<RandomSequence> random;
    std::vector<PathResult> results;
    for (int& sample = tile_samples_[tile]; sample < samples; ++sample) {
        rays.clear();
        random.clear();
        for (const glm::ivec2& pixel : pixels) {
            RandomSequence sequence(pixel, static_cast<std::uint32_t>(sample), path_tracer_.seed);
            const glm::dvec2 in_pixel = sequence.next2(), on_lens = sequence.next2();
            rays.push_back(through_centers_ ? projection_.ray(glm::dvec2(pixel) + 0.5, glm::dvec2(0.0))
                                            : projection_.ray(glm::dvec2(pixel) + in_pixel, to_disc(on_lens)));
            random.push_back(sequence);
        }
        results.resize(rays.size());
        trace_paths(*snapshot_, prepared_, projection_, rays, random, results);

        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const std::size_t pixel = static_cast<std::size_t>(pixels[i].y) * static_cast<std::size_t>(size.x) +
                                      static_cast<std::size_t>(pixels[i].x);
            Sum& sum = sums_[pixel];
            sum.radiance += results[i].radiance;
            sum.squares += results[i].radiance * results[i].radiance;
            sum.covered += results[i].covered;
            if (layers_.direct)
                directs_[pixel] += results[i].direct;
        }
    }
}

Image ProgressiveRenderer::image(ColorEncoding encoding) const
{
    Image image = centers_;
    image.covered_count = 0;
    Layers of_samples;
    of_samples.direct = layers_.direct;
    of_samples.variance = layers_.variance;
    Image blank(projection_.size(), of_samples, encoding);
    image.color.swap(blank.color);
    image.srgb8.swap(blank.srgb8);
    image.direct.swap(blank.direct);
    image.variance.swap(blank.variance);
    const glm::ivec2 size = projection_.size();
    const Tiles tiles(size);
    for (std::size_t pixel = 0; pixel < sums_.size(); ++pixel) {
        const auto x = pixel % static_cast<std::size_t>(size.x), y = pixel / static_cast<std::size_t>(size.x);
        const double n = tile_samples_[tiles.tile_of({x, y})];
        if (n == 0.0)
            continue;
        const Sum& sum = sums_[pixel];
        image.covered_count += sum.covered > 0.0;
        const glm::dvec3 mean = sum.radiance / n;
        const double coverage = sum.covered / n, behind = (1.0 - coverage) * static_cast<double>(background_.a);
        image.set_color(pixel, glm::vec4(mean + behind * glm::dvec3(background_), coverage + behind));
        if (layers_.direct)
            image.direct[pixel] = glm::vec3(directs_[pixel] / n);
        if (layers_.variance && n > 1.0)
            image.variance[pixel] = glm::vec3(glm::max(sum.squares / n - mean * mean, 0.0) / (n - 1.0));
    }
    return image;
}

} // namespace isospline
