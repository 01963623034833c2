// Where in a pixel its rays go through.
#pragma once

#include <glm/vec2.hpp>

#include <vector>

namespace isospline {

/// A ray of a pixel: its place, (0, 0) the top left and (1, 1) the bottom right corner, and its part of the colour.
struct PixelSample {
    glm::dvec2 position{0.5};
    double weight = 1.0;
};

/// `count` places of equal weight, spread evenly, the same for every pixel and every run.
///
/// The first sample is the centre of the pixel, which depth, position, normal and ids are taken at: for an even count
/// the centre is not among the places, and comes as one more sample with a weight of zero.
/// Throws std::invalid_argument for a count outside of 1 to 65536.
std::vector<PixelSample> pixel_samples(int count);

} // namespace isospline
