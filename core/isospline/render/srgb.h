// Colours for display.
#pragma once

#include <glm/gtc/type_precision.hpp>
#include <glm/vec4.hpp>

namespace isospline {

/// Red, green and blue in the transfer curve of sRGB (IEC 61966-2-1), not premultiplied, and alpha, each rounded to 8
/// bits; from linear ones that are premultiplied by alpha. Values outside of 0 to 1 are clipped, and NaN becomes 0.
glm::u8vec4 to_srgb8(const glm::vec4& premultiplied);

} // namespace isospline
