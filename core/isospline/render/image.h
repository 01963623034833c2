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

/// Colour, and what the rays through the centres of the pixels found; rows from the top, pixels of a row from the left.
struct Image {
    Image() = default;
    /// An image of rays that all missed; curvature takes memory and time, and is there only where it is asked for.
    explicit Image(glm::ivec2 image_size, bool with_curvature = false)
        : size(image_size),
          color(pixel_count(), glm::vec4(0.0f)),
          depth(pixel_count(), std::numeric_limits<float>::infinity()),
          position(pixel_count(), glm::vec3(0.0f)),
          normal(pixel_count(), glm::vec3(0.0f)),
          albedo(pixel_count(), glm::vec3(0.0f)),
          gradient_magnitude(pixel_count(), 0.0f),
          curvature(with_curvature ? pixel_count() : 0, glm::vec2(0.0f)),
          geometry_ids(pixel_count(), invalid_id),
          primitive_ids(pixel_count(), invalid_id)
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
    std::vector<std::uint32_t> geometry_ids;  ///< invalid_id on a miss
    std::vector<std::uint32_t> primitive_ids; ///< invalid_id on a miss
    std::vector<glm::vec3> variance;          ///< of the colour, where it is an estimate; empty unless path traced

    glm::dmat4 world_to_camera{1.0};        ///< as Projection::world_to_camera()
    std::optional<glm::dmat4> world_to_ndc; ///< as Projection::world_to_ndc()
    double pixel_aspect_ratio = 1.0;
};

} // namespace isospline
