#include "isospline/shade/color_map.h"

#include "isospline/util/check.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cstddef>

namespace isospline {

void validate(const ColorMap& map)
{
    if (map.colors.size() < 2)
        throw_invalid("cmap", "two or more colours", map.colors.size());
    for (const glm::dvec3& color : map.colors)
        check_not_negative("cmap", color);
    if (!is_finite(map.limits.x) || !is_finite(map.limits.y) || map.limits.x == map.limits.y)
        throw_invalid("limits", "two finite numbers that differ",
                      to_text(map.limits.x) + " and " + to_text(map.limits.y));
}

glm::dvec3 color_of(const ColorMap& map, double value)
{
    const double last = static_cast<double>(map.colors.size() - 1);
    const double place = (value - map.limits.x) / (map.limits.y - map.limits.x) * last;
    const double inside = place > 0.0 ? std::min(place, last) : 0.0; // also for NaN
    const std::size_t below = std::min(static_cast<std::size_t>(inside), map.colors.size() - 2);
    return glm::mix(map.colors[below], map.colors[below + 1], inside - static_cast<double>(below));
}

} // namespace isospline
