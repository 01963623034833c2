// The check that every ray query makes of its rays.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/util/check.h"

#include <glm/geometric.hpp>

#include <cstddef>
#include <string>

namespace isospline {

/// Returns the length of the ray's direction. Throws std::invalid_argument if the ray's origin is not finite or the
/// direction's length is not one that can be computed with; `index` names the ray in the error.
inline double check_ray(const Ray& ray, std::size_t index)
{
    const double length = glm::length(ray.direction);
    // The squares of others are not numbers of full precision.
    if (!(length >= 1e-150 && length <= 1e150))
        throw_invalid("rays", "directions of lengths from 1e-150 to 1e150",
                      to_text(ray.direction) + " in ray " + std::to_string(index));
    // Zero times a number that is not finite is NaN, not zero.
    if (!(glm::dot(ray.origin, glm::dvec3(0.0)) == 0.0))
        throw_invalid("rays", "finite origins", "one that is not, in ray " + std::to_string(index));
    return length;
}

} // namespace isospline
