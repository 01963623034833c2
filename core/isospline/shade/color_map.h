// Colour maps: from a number to a colour.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <vector>

namespace isospline {

/// Linear colours at equal steps over a range of values, with linear interpolation.
struct ColorMap {
    std::vector<glm::dvec3> colors{glm::dvec3(0.0), glm::dvec3(1.0)}; ///< two or more
    glm::dvec2 limits{0.0, 1.0}; ///< the values of the first and the last colour; values beyond are clamped
};

/// Throws std::invalid_argument for fewer than two colours, a colour that is negative or not finite, and limits that
/// are equal or not finite. The second limit may be the smaller one.
void validate(const ColorMap& map);

/// The colour of a value; NaN gets the first one.
glm::dvec3 color_of(const ColorMap& map, double value);

} // namespace isospline
