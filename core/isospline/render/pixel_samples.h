// Where in a pixel, and where in a lens, its rays go through.
#pragma once

#include <glm/vec2.hpp>

#include <optional>
#include <vector>

namespace isospline {

/// A ray of a pixel: its place, (0, 0) the top left and (1, 1) the bottom right corner, and its part of the colour.
struct PixelSample {
    glm::dvec2 position{0.5};
    double weight = 1.0;
    /// Its place on the lens, as a point of the unit square; nothing stands for the lens's centre.
    std::optional<glm::dvec2> lens = std::nullopt;
};

/// `count` places of equal weight, spread evenly, the same for every pixel and every run.
///
/// The first sample is the centre of the pixel, which depth, position, normal and ids are taken at: for an even count
/// the centre is not among the places, and comes as one more sample with a weight of zero.
/// Throws std::invalid_argument for a count outside of 1 to 65536.
///
/// Through a lens the first sample, which also goes through the centre of the lens, always comes as one more.
std::vector<PixelSample> pixel_samples(int count, bool with_lens = false);

/// Where on the unit disc a sample of a pixel goes through the lens. The places of a pixel's samples are those of every
/// other pixel's, moved by a hash of the pixel, so that few samples show as noise and not as several images.
glm::dvec2 lens_position(const glm::dvec2& lens, glm::ivec2 pixel);
inline glm::dvec2 lens_position(const PixelSample& sample, glm::ivec2 pixel)
{
    return sample.lens ? lens_position(*sample.lens, pixel) : glm::dvec2(0.0);
}

} // namespace isospline
