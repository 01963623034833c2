// Images as OpenEXR files.
#pragma once

#include "isospline/render/image.h"
#include "isospline/util/progress.h"

#include <filesystem>

namespace isospline {

struct ExrOptions {
    bool half = false; ///< stores R, G, B and A in 16 instead of 32 bits
};

/// Writes an image with the channels R G B A and, of its layers, Z (along the viewing direction, world units), P.X P.Y
/// P.Z, N.X N.Y N.Z, albedo.R albedo.G albedo.B, gradient_magnitude, curvature.mean and curvature.gaussian,
/// ambient_occlusion, direct.R direct.G direct.B, variance.R variance.G variance.B, id.geometry, id.primitive and
/// id.primitive_high (unsigned integers); compressed by ZIP. The header has worldToCamera and, except for panoramas,
/// worldToNDC, as OpenEXR defines them. Throws std::invalid_argument for an image of 8-bit sRGB.
///
/// OpenEXR's integers have 32 bits: a primitive id is id.primitive + 2^32 id.primitive_high, 0xffffffff in both on a
/// miss.
///
/// The file is written completely or not at all: under another name in the same folder, and then renamed. Throws
/// std::filesystem::filesystem_error, which names the path, if it cannot be written, and Cancelled if `progress`
/// returns false.
void write_exr(const Image& image, const std::filesystem::path& path, const ExrOptions& options = {},
               const Progress& progress = {});

} // namespace isospline
