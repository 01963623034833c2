// Light from interleaved samples: the pixels of a block of 4 x 4 send their rays in different directions.
//
// So the mean over such a block has sixteen times the directions of a pixel, and the differences of its pixels cancel:
// A. Keller, W. Heidrich, "Interleaved sampling", Eurographics Workshop on Rendering 2001. Where light changes slowly,
// only one pixel in four sends rays, and the block is one of 8 x 8 pixels.
#pragma once

#include "isospline/render/image.h"
#include "isospline/util/progress.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace isospline {

/// Columns and rows from one pixel to the next of a block where light changes slowly.
inline constexpr int coarse_step = 2;
/// Pixels on each side that count in the mean of a pixel: those of a block of 4 x 4, centred, where light changes fast.
inline constexpr int fine_reach = 2, coarse_reach = fine_reach * coarse_step;

/// One number for each pixel of a picture, 0 for those that are not in the mask.
using PixelMask = std::vector<std::uint8_t>;

/// Pictures of the same rays in a light, with and without shadows.
struct PicturesOfLight {
    const Image* lit; ///< its pixels without coverage sent no rays
    const Image* unhidden;
};
/// The key light and the sky.
inline constexpr std::size_t light_count = 2;
/// The parts of light that arrive at each pixel: of each light, one or those of its red, green and blue.
using LightParts = std::vector<std::vector<float>>;
/// Which parts of a light there are. One is that of every colour where a pixel shows one surface. Where it shows
/// several of different colours, as through translucent ones, each of them gets another part.
enum class PartsOfLight { one, by_channel };

/// A picture that counts in a sum, and its weight.
struct PictureInSum {
    const Image* picture;
    float weight;
};

/// The pixels beside another surface than their own, and those of the background: they may show a part of a surface.
PixelMask edges(const Image& guides, const Progress& progress = {});

/// The pixels for which one ray is not enough: their sum of pictures differs from that of one of the eight neighbours,
/// or they show a surface and are in `edges`. The pictures have no noise, and one ray for each pixel.
PixelMask uneven_pixels(std::span<const PictureInSum> sum, const Image& guides, const PixelMask& edges,
                        const Progress& progress = {});

/// For each light and each pixel of a mask the parts of the light that arrive: the mean over the block around the
/// pixel, where it shows the same smooth surface, or NaN if no pixel there has cast rays. Edges have the means of
/// edges. `guides` has positions, normals and geometry ids. The pixels of blocks are `step` columns and rows apart.
LightParts seen_parts(const std::array<PicturesOfLight, light_count>& lights, PartsOfLight kind, const Image& guides,
                      const PixelMask& edges, const PixelMask& mask, int step, const Progress& progress = {});

/// How fast coarse parts of light change at each pixel over a smooth surface: from 0, where they are good, to 1, where
/// they are NaN or those of blocks of 4 x 4 are needed.
std::vector<float> changes(const LightParts& parts, const Image& guides, const PixelMask& edges,
                           const Progress& progress = {});

/// The means of a picture's numbers over the block around each pixel, with weights; 0 where all of these are. `first`
/// is the picture's first pixel in a larger one. The pixels of blocks are `step` columns and rows apart.
std::vector<float> mean_on_plane(const glm::ivec2& size, const glm::ivec2& first, std::span<const float> numbers,
                                 std::span<const float> weights, int step, const Progress& progress = {});

/// How fast coarse means over a plane change at each pixel, as for changes().
std::vector<float> changes_on_plane(const glm::ivec2& size, std::span<const float> means,
                                    const Progress& progress = {});

/// The pixels of which one at most `reach` columns and rows away is in a mask.
PixelMask widened(const glm::ivec2& size, const PixelMask& mask, int reach, const Progress& progress = {});

} // namespace isospline
