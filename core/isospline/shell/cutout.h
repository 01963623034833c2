// What is cut away from an isosurface: whole cells by a mask, straight parts by half-spaces.
#pragma once

#include "isospline/math/ray.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace isospline {

class Volume;

/// The side of a plane that is kept: the points x with <normal, x> >= offset.
struct HalfSpace {
    glm::dvec3 normal{0.0, 0.0, 1.0};
    double offset = 0.0;
};

/// The same half-space in another space, given the map from that other space to the half-space's own.
HalfSpace pull_back(const HalfSpace& half_space, const glm::dmat4& map);

/// The six half-spaces whose intersection is a box.
std::vector<HalfSpace> half_spaces(const Box& box);

/// The part of a ray inside all of the half-spaces, or nothing. The ray is in the half-spaces' space.
std::optional<Interval> clip(const Ray& ray, const std::vector<HalfSpace>& half_spaces);

/// One byte a sample, x fastest, 0 where the sample is cut away. A cell is cut away with any sample that it is centred
/// on (even degrees) or that is one of its corners (odd degrees, the rule of VTK's blanking).
using Mask = std::vector<std::uint8_t>;

} // namespace isospline
