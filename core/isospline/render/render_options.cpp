#include "isospline/render/projection.h"
#include "isospline/render/renderer.h"
#include "isospline/render/tiles.h"
#include "isospline/scene/settling_gain.h"
#include "isospline/util/error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace isospline {

Window rendered_window(const std::optional<Window>& crop, const glm::ivec2& size)
{
    if (!crop)
        return {glm::ivec2(0), size};
    for (int axis = 0; axis < 2; ++axis)
        if (crop->first[axis] < 0 || crop->size[axis] < 1 || crop->size[axis] > size[axis] - crop->first[axis])
            throw_invalid("crop",
                          "columns and rows within " + std::to_string(size.x) + " x " + std::to_string(size.y) +
                              " pixels",
                          std::to_string(crop->size.x) + " x " + std::to_string(crop->size.y) + " from " +
                              std::to_string(crop->first.x) + ", " + std::to_string(crop->first.y));
    return *crop;
}

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

Fragments::Fragments(std::span<const PixelSample> samples, std::size_t pixel_count)
    : t(samples.size() * pixel_count, std::numeric_limits<double>::infinity()), geometry_ids(t.size(), invalid_id),
      primitive_ids(t.size(), invalid_primitive_id), colors(t.size(), glm::dvec3(0.0))
{
    for (const PixelSample& sample : samples)
        weights.push_back(sample.weight);
}

void Fragments::set_hit(std::size_t place, const Hit& hit)
{
    t[place] = hit.t;
    geometry_ids[place] = hit.geometry_id;
    primitive_ids[place] = hit.primitive_id;
}

std::uint64_t settling_gain(const RenderOptions& options, std::span<const Look> further)
{
    const glm::ivec2 size = rendered_window(options.crop, options.size).size;
    const double in_window = options.mask.empty()
                                 ? static_cast<double>(size.x) * size.y
                                 : static_cast<double>(options.mask.size()) -
                                       static_cast<double>(std::count(options.mask.begin(), options.mask.end(), 0));
    const auto of_look = [](const Look& look) {
        double most = 0.0;
        const auto add = [&](const Shading& shading) {
            double to_lights = 0.0, to_sky = 0.0;
            if (const auto* phong = std::get_if<Phong>(&shading); phong && phong->shadows)
                for (const Light& light : phong->lights ? *phong->lights : std::vector<Light>(2))
                    to_lights += shadow_ray_count(*phong, light);
            else if (const auto* occlusion = std::get_if<AmbientOcclusion>(&shading))
                to_sky = occlusion->samples;
            // About half of the pixels show surfaces. Rays through neighbouring pixels gain less than other packets,
            // and the many rays from one point to the sky more.
            constexpr double of_first_hit = 0.3, of_ray_to_light = 0.3, of_ray_to_sky = 20.0;
            constexpr auto through_all = static_cast<double>(SettlingGain::of_ray_through_all);
            const double of_opaque = of_first_hit + 0.5 * (of_ray_to_light * to_lights + of_ray_to_sky * to_sky);
            const double of_translucent = through_all * (1.0 + 0.5 * (to_lights + to_sky));
            most = std::max(most, even_opacity(shading) == 1.0 ? of_opaque : of_translucent);
        };
        add(look.shading);
        for (const auto& [geometry_id, shading] : look.shading_of_geometry)
            add(shading);
        return most;
    };
    double gain = of_look(options);
    for (const Look& look : further)
        gain += of_look(look);
    gain = gain * options.samples + options.gain_of_further_passes;
    const double step = checked_step(options.step);
    // Numbers that are refused later may be negative.
    return static_cast<std::uint64_t>(std::max(0.0, gain * in_window / (step * step)));
}

Image blank_image(const Projection& projection, const Window& window, const Layers& layers, ColorEncoding encoding)
{
    Image image(window.size, layers, encoding);
    image.full_size = projection.size();
    image.first = window.first;
    image.world_to_camera = projection.world_to_camera();
    image.world_to_ndc = projection.world_to_ndc();
    image.pixel_aspect_ratio = projection.pixel_aspect_ratio();
    return image;
}

void validate(const RenderOptions& options, bool is_part)
{
    validate_background(options.background);
    validate(options.layers);
    if (options.layers.direct || options.layers.variance)
        throw_invalid("layers", "direct and variance of path traced pictures only",
                      options.layers.direct ? "direct of another" : "variance of another");
    const glm::vec<2, std::size_t> window(rendered_window(options.crop, options.size).size);
    if (!options.mask.empty() && options.mask.size() != window.x * window.y)
        throw_invalid("mask", "a number for each pixel of the window", options.mask.size());
    if (options.layers.certified && is_part)
        throw_invalid("layers", "certified of whole scenes only", "certified of a part");
}

void validate_again(const RenderOptions& options, std::size_t look_count, std::span<Image* const> images)
{
    const glm::ivec2 size = rendered_window(options.crop, options.size).size;
    const auto fits = [&](const Image* image) { return image != nullptr && image->size == size; };
    if (images.size() != look_count || !std::all_of(images.begin(), images.end(), fits))
        throw_invalid("images", "one of the window's size for each look", std::to_string(images.size()) + " images");
    if (options.layers.any_of_centers())
        throw_invalid("layers", "none for pixels that are rendered again", "some");
}

void set_layers(Image& image, std::size_t pixel, const Layers& layers, const Hit& hit, const SurfacePoint& point,
                const Shading& shading, const glm::dvec3& position_origin)
{
    if (layers.depth)
        image.depth[pixel] = static_cast<float>(point.depth);
    if (layers.position)
        image.position[pixel] = glm::vec3(point.position - position_origin);
    if (layers.normal)
        image.normal[pixel] = glm::vec3(point.normal);
    if (layers.albedo)
        image.albedo[pixel] = glm::vec3(albedo(shading, point));
    if (layers.gradient_magnitude)
        image.gradient_magnitude[pixel] = static_cast<float>(hit.gradient_magnitude);
    if (layers.curvature)
        image.curvature[pixel] = glm::vec2(point.curvature.mean, point.curvature.gaussian);
    if (layers.geometry_ids)
        image.geometry_ids[pixel] = hit.geometry_id;
    if (layers.primitive_ids)
        image.primitive_ids[pixel] = hit.primitive_id;
}

} // namespace isospline
