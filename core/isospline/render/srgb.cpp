#include "isospline/render/srgb.h"

#include <glm/ext/vector_double1.hpp>
#include <glm/gtc/color_space.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace isospline {

namespace {

/// Encodes a linear value and rounds the result. It looks up the code of the lower end of the value's bin; at most a
/// few thresholds of the bin are below the value.
class Encoder {
public:
    Encoder()
    {
        for (std::size_t code = 0; code < 255; ++code)
            thresholds_[code] = glm::convertSRGBToLinear(glm::dvec1((static_cast<double>(code) + 0.5) / 255.0)).x;
        thresholds_[255] = std::numeric_limits<double>::infinity();
        std::size_t code = 0;
        for (std::size_t bin = 0; bin < bin_count; ++bin) {
            while (thresholds_[code] <= static_cast<double>(bin) / bin_count)
                ++code;
            first_[bin] = static_cast<std::uint8_t>(code);
        }
    }

    std::uint8_t operator()(double linear) const
    {
        if (!(linear > 0.0))
            return 0;
        if (linear >= 1.0)
            return 255;
        std::size_t code = first_[static_cast<std::size_t>(linear * bin_count)];
        while (thresholds_[code] <= linear)
            ++code;
        return static_cast<std::uint8_t>(code);
    }

private:
    static constexpr std::size_t bin_count = 4096;

    std::array<double, 256> thresholds_; ///< from the i-th on the code is above i
    std::array<std::uint8_t, bin_count> first_;
};

} // namespace

glm::u8vec4 to_srgb8(const glm::vec4& premultiplied)
{
    static const Encoder encode;
    const auto alpha = static_cast<double>(premultiplied.a);
    if (!(alpha > 0.0))
        return glm::u8vec4(0);
    const auto part = [&](float color) { return encode(static_cast<double>(color) / alpha); };
    return {part(premultiplied.r), part(premultiplied.g), part(premultiplied.b),
            alpha >= 1.0 ? 255 : static_cast<std::uint8_t>(std::lrint(255.0 * alpha))};
}

} // namespace isospline
