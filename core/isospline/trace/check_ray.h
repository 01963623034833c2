// The check that every ray query makes of its rays.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/util/error.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <cstddef>
#include <string>

namespace isospline {

/// Returns the length of the ray's direction. Throws std::invalid_argument if the ray's origin or direction is not
/// finite or the direction is zero; `index` names the ray in the error.
inline double check_ray(const Ray& ray, std::size_t index)
{
    const double length = glm::length(ray.direction);
    if (!(length > 0.0 && std::isfinite(length)))
        throw_invalid("rays", "finite directions that are not zero",
                      "one of length " + std::to_string(length) + " in ray " + std::to_string(index));
    // Zero times a number that is not finite is NaN, not zero.
    if (!(glm::dot(ray.origin, glm::dvec3(0.0)) == 0.0))
        throw_invalid("rays", "finite origins", "one that is not, in ray " + std::to_string(index));
    return length;
}

} // namespace isospline
