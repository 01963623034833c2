// A rendered image.
#pragma once

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

/// What images have only where it is asked for, as it takes memory and time.
struct Layers {
    bool curvature = false;    ///< Image::curvature
    int ambient_occlusion = 0; ///< rays a hit that Image::ambient_occlusion is the mean of, to 65536; 0 for none
    bool direct = false;       ///< Image::direct, of a path tracer
};

/// Colour, and what the rays through the centres of the pixels found; rows from the top, pixels of a row from the left.
struct Image {
    Image() = default;
    /// An image of rays that all missed.
    explicit Image(glm::ivec2 image_size, const Layers& layers = {})
        : size(image_size), color(pixel_count(), glm::vec4(0.0f)),
          depth(pixel_count(), std::numeric_limits<float>::infinity()), position(pixel_count(), glm::vec3(0.0f)),
          normal(pixel_count(), glm::vec3(0.0f)), albedo(pixel_count(), glm::vec3(0.0f)),
          gradient_magnitude(pixel_count(), 0.0f), curvature(layers.curvature ? pixel_count() : 0, glm::vec2(0.0f)),
          ambient_occlusion(layers.ambient_occlusion > 0 ? pixel_count() : 0, 0.0f),
          direct(layers.direct ? pixel_count() : 0, glm::vec3(0.0f)), geometry_ids(pixel_count(), invalid_id),
          primitive_ids(pixel_count(), invalid_primitive_id)
    {
    }

    std::size_t pixel_count() const { return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y); }

    glm::ivec2 size{0};
    std::vector<glm::vec4> color;             ///< linear, premultiplied by the last part, coverage
    std::vector<float> depth;                 ///< as Projection::depth(), world units; infinite on a miss
    std::vector<glm::vec3> position;          ///< world space; zero on a miss
    std::vector<glm::vec3> normal;            ///< unit, outward, world space; zero on a miss
    std::vector<glm::vec3> albedo;            ///< linear colour of the surface itself; zero on a miss
    std::vector<float> gradient_magnitude;    ///< of an isosurface's f, per world unit; zero on a miss and for meshes
    std::vector<glm::vec2> curvature;         ///< mean and Gaussian, or empty; zero on a miss and for meshes
    std::vector<float> ambient_occlusion;     ///< openness, as of AmbientOcclusion, or empty; zero on a miss
    std::vector<glm::vec3> direct;            ///< the part of the colour that is light after one hit at most, or empty
    std::vector<std::uint32_t> geometry_ids;  ///< invalid_id on a miss
    std::vector<std::uint64_t> primitive_ids; ///< invalid_primitive_id on a miss
    std::vector<glm::vec3> variance;          ///< of the colour, where it is an estimate; empty unless path traced

    glm::dmat4 world_to_camera{1.0};        ///< as Projection::world_to_camera()
    std::optional<glm::dmat4> world_to_ndc; ///< as Projection::world_to_ndc()
    double pixel_aspect_ratio = 1.0;
};

} // namespace isospline
