// Light from all directions, at infinity.
#pragma once

#include "isospline/shade/light_sample.h"

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace isospline {

/// An image of all directions; the radiance of each pixel is constant: rows from z up to z down in equal steps of the
/// angle, columns in equal steps of the azimuth. Seen from inside and upright, with x in the middle of the image and y
/// in the middle of its left half.
///
/// Directions are drawn exactly in proportion to the luminance: a row by the sum of its pixels, a pixel of the row,
/// and a direction within it, uniform in solid angle.
class EnvironmentMap {
public:
    /// Throws std::invalid_argument for a size that is not positive or not that of the pixels, and for pixels that are
    /// negative or not finite.
    EnvironmentMap(glm::ivec2 size, std::vector<glm::vec3> pixels);

    glm::ivec2 size() const { return size_; }
    const std::vector<glm::vec3>& pixels() const { return pixels_; }

    /// Linear red, green and blue, for a unit direction.
    glm::dvec3 radiance(const glm::dvec3& direction) const { return pixels_[pixel_of(direction)]; }
    /// The density of sample(), by solid angle.
    double density(const glm::dvec3& direction) const;
    /// Nothing if all of the map is black.
    std::optional<LightSample> sample(const glm::dvec2& u) const;

private:
    std::size_t pixel_of(const glm::dvec3& direction) const;

    glm::ivec2 size_;
    std::vector<glm::vec3> pixels_;
    std::vector<double> row_sums_;    ///< luminance times solid angle, cumulative over rows
    std::vector<double> column_sums_; ///< luminance, cumulative over the pixels of each row
};

struct EnvironmentLight {
    glm::dvec3 radiance{1.0};                    ///< linear; multiplies the map if there is one
    std::shared_ptr<const EnvironmentMap> map{}; ///< nothing means the same radiance from all directions
    glm::dmat3 rotation{1.0};                    ///< columns are the world directions of the map's x, y and z
    bool visible = false;                        ///< whether the camera sees it where no surface is
};

/// Throws std::invalid_argument for a radiance that is negative or not finite, and for a matrix that is no rotation.
void validate(const EnvironmentLight& light);

/// The light of a unit direction; t is infinite. The density is that of sample(): 0 without a map, because
/// uniform light is best sampled by the directions that the surface draws.
Emission emission(const EnvironmentLight& light, const glm::dvec3& direction);
std::optional<LightSample> sample(const EnvironmentLight& light, const glm::dvec2& u);

} // namespace isospline
