#include "isospline/math/half_space.h"

#include "isospline/util/check.h"

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

HalfSpace pull_back(const HalfSpace& half_space, const glm::dmat4& map)
{
    // <normal, A x + b> >= offset. Components are scaled to 1 so that the square of the length does not overflow.
    const auto largest = [](const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); };
    const glm::dvec3 scaled = half_space.normal / largest(half_space.normal);
    const glm::dvec3 normal = glm::transpose(glm::dmat3(map)) * scaled;
    const double offset = half_space.offset / largest(half_space.normal) - glm::dot(scaled, glm::dvec3(map[3]));
    const double length = largest(normal) * glm::length(normal / largest(normal));
    return {normal / length, offset / length};
}

std::vector<HalfSpace> half_spaces(const Box& box)
{
    if (!(box.lower.x < box.upper.x && box.lower.y < box.upper.y && box.lower.z < box.upper.z))
        throw_invalid("box", "a minimum below the maximum along each axis",
                      to_text(box.lower) + " and " + to_text(box.upper));
    std::vector<HalfSpace> sides;
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 normal(0.0);
        normal[axis] = 1.0;
        if (std::isfinite(box.lower[axis]))
            sides.push_back({normal, box.lower[axis]});
        if (std::isfinite(box.upper[axis]))
            sides.push_back({-normal, -box.upper[axis]});
    }
    return sides;
}

std::optional<Chord> clip(const Ray& ray, const std::vector<HalfSpace>& half_spaces)
{
    Chord inside{{ray.t_near, ray.t_far}};
    for (std::size_t i = 0; i < half_spaces.size(); ++i) {
        const HalfSpace& half_space = half_spaces[i];
        const double distance = half_space.offset - glm::dot(half_space.normal, ray.origin);
        const double speed = glm::dot(half_space.normal, ray.direction);
        const double t = distance / speed;
        if (speed > 0.0 && (t > inside.t_near || (t == inside.t_near && inside.entry < 0))) {
            inside.t_near = std::max(inside.t_near, t);
            inside.entry = static_cast<int>(i);
        } else if (speed < 0.0 && (t < inside.t_far || (t == inside.t_far && inside.exit < 0))) {
            inside.t_far = std::min(inside.t_far, t);
            inside.exit = static_cast<int>(i);
        } else if (speed == 0.0 && distance > 0.0) {
            return std::nullopt;
        }
    }
    if (!(inside.t_near <= inside.t_far))
        return std::nullopt;
    return inside;
}

} // namespace isospline
