// A rendered image.
#pragma once

#include "isospline/render/srgb.h"
#include "isospline/trace/hit.h"

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

namespace isospline {

/// The layers of an image besides its colour. Only requested layers are computed and stored.
struct Layers {
    bool depth = false, position = false, normal = false, albedo = false, gradient_magnitude = false, curvature = false;
    bool ambient_occlusion = false;
    bool direct = false, variance = false; ///< of path traced images only
    bool geometry_ids = false, primitive_ids = false;
    bool certified = false;

    int ambient_occlusion_samples = 16; ///< rays per hit for Image::ambient_occlusion, 1 to 65536

    /// Whether any layer comes from the rays through the centres of the pixels.
    bool any_of_centers() const
    {
        return depth || position || normal || albedo || gradient_magnitude || curvature || ambient_occlusion ||
               geometry_ids || primitive_ids || certified;
    }
};

/// A rectangle of the pixels of a picture.
struct Window {
    glm::ivec2 first{0}; ///< column and row of its top left pixel
    glm::ivec2 size{0};

    /// The number of a pixel of the picture among those of the window, row by row.
    std::size_t number(const glm::ivec2& pixel) const
    {
        const glm::vec<2, std::size_t> place(pixel - first);
        return place.y * static_cast<std::size_t>(size.x) + place.x;
    }
};

/// The storage of colour.
enum class ColorEncoding {
    linear, ///< Image::color
    srgb8   ///< Image::srgb8, a quarter of the memory
};

/// Colour, and layers from the rays through the centres of the pixels; rows from the top, pixels of a row from the
/// left. Layers that were not requested are empty.
struct Image {
    Image() = default;
    /// An image of rays that all missed.
    explicit Image(glm::ivec2 image_size, const Layers& layers = {}, ColorEncoding encoding = ColorEncoding::linear)
        : size(image_size), full_size(image_size)
    {
        const auto make = [this]<typename Element>(bool wanted, std::vector<Element>& layer, const Element& miss) {
            if (wanted)
                layer.assign(pixel_count(), miss);
        };
        make(encoding == ColorEncoding::linear, color, glm::vec4(0.0f));
        make(encoding == ColorEncoding::srgb8, srgb8, glm::u8vec4(0));
        make(layers.depth, depth, std::numeric_limits<float>::infinity());
        make(layers.position, position, glm::vec3(0.0f));
        make(layers.normal, normal, glm::vec3(0.0f));
        make(layers.albedo, albedo, glm::vec3(0.0f));
        make(layers.gradient_magnitude, gradient_magnitude, 0.0f);
        make(layers.curvature, curvature, glm::vec2(0.0f));
        make(layers.ambient_occlusion, ambient_occlusion, 0.0f);
        make(layers.direct, direct, glm::vec3(0.0f));
        make(layers.variance, variance, glm::vec3(std::numeric_limits<float>::infinity()));
        make(layers.geometry_ids, geometry_ids, invalid_id);
        make(layers.primitive_ids, primitive_ids, invalid_primitive_id);
        make(layers.certified, certified, std::uint32_t{0});
    }

    std::size_t pixel_count() const { return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y); }

    /// Stores a colour as `color` would hold it.
    void set_color(std::size_t pixel, const glm::vec4& premultiplied)
    {
        if (srgb8.empty())
            color[pixel] = premultiplied;
        else
            srgb8[pixel] = to_srgb8(premultiplied);
    }

    /// A linear image of the same pixels without layers, in which all rays missed.
    Image blank() const
    {
        Image image = Image(size);
        image.full_size = full_size;
        image.first = first;
        image.world_to_camera = world_to_camera;
        image.world_to_ndc = world_to_ndc;
        image.pixel_aspect_ratio = pixel_aspect_ratio;
        return image;
    }

    glm::ivec2 size{0};
    std::vector<glm::vec4> color;             ///< linear, premultiplied by coverage, the last component
    std::vector<glm::u8vec4> srgb8;           ///< to_srgb8() of `color`; only one of the two is stored
    std::vector<float> depth;                 ///< like Projection::depth(), world units; infinite on a miss
    std::vector<glm::vec3> position;          ///< world space; zero on a miss
    std::vector<glm::vec3> normal;            ///< unit, outward, world space; zero on a miss
    std::vector<glm::vec3> albedo;            ///< linear colour of the surface itself; zero on a miss
    std::vector<float> gradient_magnitude;    ///< of an isosurface's f, per world unit; zero on a miss and for meshes
    std::vector<glm::vec2> curvature;         ///< mean and Gaussian; zero on a miss and for meshes
    std::vector<float> ambient_occlusion;     ///< openness, like AmbientOcclusion; zero on a miss
    std::vector<glm::vec3> direct;            ///< the part of the colour from light after at most one hit
    std::vector<glm::vec3> variance;          ///< of the colour, which is an estimate; infinite if unknown
    std::vector<std::uint32_t> geometry_ids;  ///< invalid_id on a miss
    std::vector<std::uint64_t> primitive_ids; ///< invalid_primitive_id on a miss
    std::vector<std::uint32_t> certified;     ///< RayStatus: what is proven of the rays

    std::size_t covered_count = 0; ///< pixels that surfaces cover, at least in part

    // Data of the whole picture, if the image is a window of it.
    glm::ivec2 full_size{0};                ///< its size
    glm::ivec2 first{0};                    ///< the position of the image's first pixel in it
    glm::dmat4 world_to_camera{1.0};        ///< as Projection::world_to_camera()
    std::optional<glm::dmat4> world_to_ndc; ///< as Projection::world_to_ndc()
    double pixel_aspect_ratio = 1.0;
};

} // namespace isospline
