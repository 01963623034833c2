// Light from interleaved samples: the pixels of a block of 4 x 4 send their rays in different directions.
//
// So the mean over such a block has sixteen times the directions of a pixel, and the differences of its pixels cancel:
// A. Keller, W. Heidrich, "Interleaved sampling", Eurographics Workshop on Rendering 2001.
#pragma once

#include "isospline/render/image.h"
#include "isospline/util/progress.h"

#include <span>
#include <vector>

namespace isospline {

/// Pixels on each side that count in the mean of a pixel: those of a block of 4 x 4, centred.
inline constexpr int block_reach = 2;

/// Pictures of the same rays in a light, with and without shadows.
struct PicturesOfLight {
    const Image* lit;
    const Image* unhidden;
};

/// For each light and each pixel the part of the light that arrives: the mean over the block around the pixel, where it
/// shows the same smooth surface. Pixels beside another surface may show a part of it; they have the means of such
/// pixels. `guides` has positions, normals and geometry ids.
std::vector<std::vector<float>> seen_parts(std::span<const PicturesOfLight> lights, const Image& guides,
                                           const Progress& progress = {});

/// The means of a picture's numbers over the block around each pixel, with weights; 0 where all of these are.
std::vector<float> mean_on_plane(const glm::ivec2& size, std::span<const float> numbers, std::span<const float> weights,
                                 const Progress& progress = {});

} // namespace isospline
