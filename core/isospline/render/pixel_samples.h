// The positions of a pixel's rays in the pixel and on the lens.
#pragma once

#include <glm/vec2.hpp>

#include <optional>
#include <vector>

namespace isospline {

/// A ray of a pixel: its position, from (0, 0) at the top left to (1, 1) at the bottom right corner, and its weight.
struct PixelSample {
    glm::dvec2 position{0.5};
    double weight = 1.0;
    /// Its position on the lens, as a point of the unit square; nothing means the lens's centre.
    std::optional<glm::dvec2> lens = std::nullopt;
};

/// `count` evenly spread positions of equal weight, the same for every pixel and every run.
///
/// The first sample is the centre of the pixel, for depth, position, normal and ids. For an even count, the centre is
/// not one of the positions, and is added as one more sample with weight zero. Throws std::invalid_argument for a count
/// outside of 1 to 65536.
///
/// With a lens, the first sample also goes through the centre of the lens, and is always added as one more.
std::vector<PixelSample> pixel_samples(int count, bool with_lens = false);

/// The position on the unit disc where a sample of a pixel goes through the lens. All pixels have the same positions,
/// shifted by a hash of the pixel, so that few samples show as noise and not as several images.
glm::dvec2 lens_position(const glm::dvec2& lens, glm::ivec2 pixel);
inline glm::dvec2 lens_position(const PixelSample& sample, glm::ivec2 pixel)
{
    return sample.lens ? lens_position(*sample.lens, pixel) : glm::dvec2(0.0);
}

} // namespace isospline
