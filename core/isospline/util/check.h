// Checks of numbers and vectors that callers pass in.
#pragma once

#include "isospline/util/error.h"

#include <glm/vec3.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>

namespace isospline {

inline bool is_finite(double value)
{
    return std::isfinite(value);
}

inline bool is_finite(const glm::dvec3& vector)
{
    return std::isfinite(vector.x) && std::isfinite(vector.y) && std::isfinite(vector.z);
}

inline std::string to_text(double value)
{
    std::ostringstream text;
    text << value;
    return text.str();
}

inline std::string to_text(const glm::dvec3& vector)
{
    return "(" + to_text(vector.x) + ", " + to_text(vector.y) + ", " + to_text(vector.z) + ")";
}

inline void check_finite(const char* parameter, const glm::dvec3& vector)
{
    if (!is_finite(vector))
        throw_invalid(parameter, "three finite numbers", to_text(vector));
}

inline void check_direction(const char* parameter, const glm::dvec3& vector)
{
    if (!is_finite(vector) || vector == glm::dvec3(0.0))
        throw_invalid(parameter, "three finite numbers, not all of them zero", to_text(vector));
}

inline void check_not_negative(const char* parameter, double value)
{
    if (!(is_finite(value) && value >= 0.0))
        throw_invalid(parameter, "a finite number of at least 0", value);
}

inline void check_not_negative(const char* parameter, const glm::dvec3& vector)
{
    if (!(is_finite(vector) && vector.x >= 0.0 && vector.y >= 0.0 && vector.z >= 0.0))
        throw_invalid(parameter, "finite numbers of at least 0", to_text(vector));
}

/// Checks the count of items that have 32-bit indices, in Embree or in faces; the largest index means none.
inline void check_count(const char* parameter, std::uint64_t count)
{
    constexpr std::uint64_t most = 0xffffffff;
    if (count > most)
        throw_invalid(parameter, "at most " + std::to_string(most), count);
}

/// Checks that there is one item of an output for each ray.
inline void check_one_per_ray(const char* parameter, std::size_t rays, std::size_t items)
{
    if (items != rays)
        throw_invalid(parameter, "one for each of " + std::to_string(rays) + " rays", items);
}

inline void check_fraction(const char* parameter, double value)
{
    if (!(value >= 0.0 && value <= 1.0))
        throw_invalid(parameter, "a number from 0 to 1", value);
}

inline void check_positive(const char* parameter, double value)
{
    if (!(is_finite(value) && value > 0.0))
        throw_invalid(parameter, "a finite number above 0", value);
}

} // namespace isospline
