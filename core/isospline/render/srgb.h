// Colours for display.
#pragma once

#include <glm/gtc/type_precision.hpp>
#include <glm/vec4.hpp>

namespace isospline {

/// Red, green and blue in the transfer curve of sRGB (IEC 61966-2-1), not premultiplied, and alpha, each rounded to 8
/// bits; from linear ones that are premultiplied by alpha. What is beyond 0 and 1 is clipped, and NaN is 0.
glm::u8vec4 to_srgb8(const glm::vec4& premultiplied);

} // namespace isospline
