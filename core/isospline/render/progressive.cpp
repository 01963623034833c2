#include "isospline/render/progressive.h"

#include "isospline/math/frame.h"
#include "isospline/render/path_batch.h"
#include "isospline/render/renderer.h"
#include "isospline/render/tiles.h"
#include "isospline/scene/scene.h"
#include "isospline/scene/settling_gain.h"
#include "isospline/util/check.h"
#include "isospline/util/error.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

namespace isospline {

namespace {

/// The part of a material that a picture of the centres shows: its colour, as albedo.
Phong unlit(const Material& material)
{
    Phong phong;
    phong.color = color_of(material);
    phong.cap_color = material.cap_color;
    phong.lights.emplace();
    return phong;
}

RenderOptions centers_only(const PathTracer& path_tracer, glm::ivec2 size, const Window& window,
                           const glm::vec4& background, const Layers& layers)
{
    RenderOptions options;
    options.size = size;
    options.crop = window;
    options.shading = unlit(path_tracer.material);
    for (const auto& [geometry_id, material] : path_tracer.material_of_geometry)
        options.shading_of_geometry.emplace(geometry_id, unlit(material));
    options.background = background;
    options.layers = layers;
    options.layers.direct = options.layers.variance = false;
    return options;
}

/// A path tracer with a material for every object of a scene, and with limits of depth that fit it.
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

/// The variance of the mean over n samples, at least 2.
glm::dvec3 variance_of_mean(const PathSums::Sum& sum, double n)
{
    const glm::dvec3 mean = sum.radiance / n;
    return glm::max(sum.squares / n - mean * mean, 0.0) / (n - 1.0);
}

} // namespace

ProgressiveRenderer::ProgressiveRenderer(Scene& scene, const Camera& camera, glm::ivec2 size, PathTracer path_tracer,
                                         glm::vec4 background, const Layers& layers, const std::optional<Window>& crop)
    : scene_(scene), camera_(camera), projection_(camera, size), window_(rendered_window(crop, size)),
      path_tracer_(std::move(path_tracer)), background_(background), layers_(layers)
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
    centers_ = blank_image(projection_, window_, layers_);
    has_centers_ = false;
    snapshot_.reset();
    clear_sums(false);
}

void ProgressiveRenderer::clear_sums(bool through_centers)
{
    path_sums_.sums.assign(centers_.pixel_count(), PathSums::Sum());
    path_sums_.directs.assign(layers_.direct ? centers_.pixel_count() : 0, glm::dvec3(0.0));
    path_sums_.tile_samples.assign(Tiles(window_.size).count(), 0);
    path_sums_.through_centers = through_centers;
}

void ProgressiveRenderer::resume(PathSums path_sums, const char* parameter, const Progress& progress)
{
    const auto check = [&](const char* what, std::size_t expected, std::size_t got) {
        if (got != expected)
            throw_invalid(parameter, std::to_string(expected) + " " + what, got);
    };
    if (!layers_.direct)
        path_sums.directs.clear();
    else if (path_sums.directs.empty())
        throw_invalid(parameter, "one with the layer \"direct\"", "one without it");
    check("pixels", path_sums_.sums.size(), path_sums.sums.size());
    check("pixels of direct light", path_sums_.directs.size(), path_sums.directs.size());
    check("tiles", path_sums_.tile_samples.size(), path_sums.tile_samples.size());
    for (const int samples : path_sums.tile_samples)
        if (samples < 0)
            throw_invalid(parameter, "tiles of at least 0 samples", samples);
    for (const PathSums::Sum& sum : path_sums.sums) {
        check_not_negative(parameter, sum.radiance);
        check_not_negative(parameter, sum.squares);
        check_not_negative(parameter, sum.covered);
    }
    for (const glm::dvec3& direct : path_sums.directs)
        check_not_negative(parameter, direct);

    reset();
    begin(0, progress);
    path_sums_ = std::move(path_sums);
}

int ProgressiveRenderer::samples() const
{
    return *std::min_element(path_sums_.tile_samples.begin(), path_sums_.tile_samples.end());
}

void ProgressiveRenderer::step(int samples, const Progress& progress)
{
    if (samples < 1)
        throw_invalid("samples", "a number of at least 1", samples);
    if (const int left = std::numeric_limits<int>::max() - this->samples(); samples > left)
        throw_invalid("samples", "at most " + std::to_string(left) + " more", samples);
    const int wanted = this->samples() + samples;
    if (!has_centers_)
        begin(samples, part_of(progress, 0.0, 0.05));
    else
        continue_with(samples, part_of(progress, 0.0, 0.05));

    // A picture with one sample agrees with its ids. With more samples, they are anywhere in the pixel, and the first
    // one is not one of them.
    if (const bool through_centers = wanted == 1; through_centers != path_sums_.through_centers)
        clear_sums(through_centers);

    // Sample by sample, so that the whole picture has the same quality whenever it is cancelled.
    const Progress of_samples = part_of(progress, 0.05, 1.0);
    const int first = this->samples(), count = wanted - first;
    for (int done = 0; done < count; ++done)
        parallel_for(
            path_sums_.tile_samples.size(), 1,
            [&](std::size_t begin, std::size_t end) {
                for (std::size_t tile = begin; tile < end; ++tile)
                    render_tile(tile, first + done + 1);
            },
            part_of(of_samples, static_cast<double>(done) / count, static_cast<double>(done + 1) / count));
}

void ProgressiveRenderer::check_current() const
{
    if (has_centers_ && !scene_.is_current(*snapshot_))
        throw std::logic_error("the scene has changed since the first step: reset() the renderer before the next");
}

const PathSums& ProgressiveRenderer::path_sums() const
{
    check_current();
    return path_sums_;
}

std::shared_ptr<const SceneSnapshot> ProgressiveRenderer::snapshot_for(int samples, const Progress& progress) const
{
    const std::uint64_t path_count =
        static_cast<std::uint64_t>(centers_.pixel_count()) * static_cast<std::uint64_t>(samples);
    return scene_.snapshot(progress, SettlingGain::of_path * path_count);
}

/// The scene may have settled indexes by now.
void ProgressiveRenderer::continue_with(int samples, const Progress& progress)
{
    check_current();
    std::shared_ptr<const SceneSnapshot> newest = snapshot_for(samples, progress);
    check_current(); // then the newest one shows the same
    snapshot_ = std::move(newest);
}

void ProgressiveRenderer::begin(int samples, const Progress& progress)
{
    snapshot_ = snapshot_for(samples, part_of(progress, 0.0, 0.5));
    prepared_ = prepared(path_tracer_, *snapshot_, projection_);
    if (layers_.any_of_centers())
        centers_ =
            render(*snapshot_, camera_, centers_only(prepared_, projection_.size(), window_, background_, layers_),
                   part_of(progress, 0.5, 1.0));
    for (glm::vec3& albedo : centers_.albedo)
        albedo = glm::min(albedo, 1.0f);
    has_centers_ = true;
}

void ProgressiveRenderer::render_tile(std::size_t tile, int samples)
{
    std::vector<glm::ivec2> pixels; // of the window
    Tiles(window_.size).get_pixels(tile, pixels);
    std::vector<Ray> rays;
    std::vector<RandomSequence> random;
    std::vector<PathResult> results;
    for (int& sample = path_sums_.tile_samples[tile]; sample < samples; ++sample) {
        rays.clear();
        random.clear();
        for (const glm::ivec2& local : pixels) {
            const glm::ivec2 pixel = window_.first + local;
            RandomSequence sequence(pixel, static_cast<std::uint32_t>(sample), path_tracer_.seed);
            const glm::dvec2 in_pixel = sequence.next2(), on_lens = sequence.next2();
            rays.push_back(path_sums_.through_centers
                               ? projection_.ray(glm::dvec2(pixel) + 0.5, glm::dvec2(0.0))
                               : projection_.ray(glm::dvec2(pixel) + in_pixel, to_disc(on_lens)));
            random.push_back(sequence);
        }
        results.resize(rays.size());
        trace_paths(*snapshot_, prepared_, projection_, rays, random, results);

        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const std::size_t pixel = static_cast<std::size_t>(pixels[i].y) * static_cast<std::size_t>(window_.size.x) +
                                      static_cast<std::size_t>(pixels[i].x);
            PathSums::Sum& sum = path_sums_.sums[pixel];
            sum.radiance += results[i].radiance;
            sum.squares += results[i].radiance * results[i].radiance;
            sum.covered += results[i].covered;
            if (layers_.direct)
                path_sums_.directs[pixel] += results[i].direct;
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
    Image blank(window_.size, of_samples, encoding);
    image.color.swap(blank.color);
    image.srgb8.swap(blank.srgb8);
    image.direct.swap(blank.direct);
    image.variance.swap(blank.variance);
    const glm::ivec2 size = window_.size;
    const Tiles tiles(size);
    for (std::size_t pixel = 0; pixel < path_sums_.sums.size(); ++pixel) {
        const auto x = pixel % static_cast<std::size_t>(size.x), y = pixel / static_cast<std::size_t>(size.x);
        const double n = path_sums_.tile_samples[tiles.tile_of({x, y})];
        if (n == 0.0)
            continue;
        const PathSums::Sum& sum = path_sums_.sums[pixel];
        image.covered_count += sum.covered > 0.0;
        const glm::dvec3 mean = sum.radiance / n;
        const double coverage = sum.covered / n, behind = (1.0 - coverage) * static_cast<double>(background_.a);
        image.set_color(pixel, glm::vec4(mean + behind * glm::dvec3(background_), coverage + behind));
        if (layers_.direct)
            image.direct[pixel] = glm::vec3(path_sums_.directs[pixel] / n);
        if (layers_.variance && n > 1.0)
            image.variance[pixel] = glm::vec3(variance_of_mean(sum, n));
    }
    return image;
}

double ProgressiveRenderer::noise() const
{
    const double n = samples();
    const auto& counts = path_sums_.tile_samples;
    if (n < 2.0 || std::adjacent_find(counts.begin(), counts.end(), std::not_equal_to<>()) != counts.end())
        return std::numeric_limits<double>::infinity();
    double sum_of_squares = 0.0;
    for (const PathSums::Sum& sum : path_sums_.sums) {
        const auto shown = [](const glm::dvec3& color) { return glm::sqrt(glm::min(color, 1.0)); };
        const glm::dvec3 mean = sum.radiance / n;
        const glm::dvec3 change = shown(mean + glm::sqrt(variance_of_mean(sum, n))) - shown(mean);
        sum_of_squares += glm::dot(change, change);
    }
    return std::sqrt(sum_of_squares / (3.0 * static_cast<double>(path_sums_.sums.size())));
}

} // namespace isospline
