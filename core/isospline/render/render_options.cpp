#include "isospline/render/projection.h"
#include "isospline/render/renderer.h"
#include "isospline/util/error.h"

#include <cmath>
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
    if (options.layers.certified && is_part)
        throw_invalid("layers", "certified of whole scenes only", "certified of a part");
}

} // namespace isospline
