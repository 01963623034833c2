// Orthonormal frames about a normal, and directions in them.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

/// Right-handed unit axes x, y, z with a given z: T. Duff et al., "Building an orthonormal basis, revisited", Journal
/// of Computer Graphics Techniques 6(1), 2017.
struct Frame {
    explicit Frame(const glm::dvec3& normal) : z(normal)
    {
        const double sign = std::copysign(1.0, z.z);
        const double a = -1.0 / (sign + z.z), b = z.x * z.y * a;
        x = {1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x};
        y = {b, sign + z.y * z.y * a, -z.y};
    }

    glm::dvec3 to_world(const glm::dvec3& v) const { return v.x * x + v.y * y + v.z * z; }
    glm::dvec3 to_local(const glm::dvec3& v) const
    {
        return {v.x * x.x + v.y * x.y + v.z * x.z, v.x * y.x + v.y * y.y + v.z * y.z,
                v.x * z.x + v.y * z.y + v.z * z.z};
    }

    glm::dvec3 x, y, z;
};

inline constexpr double pi = 3.14159265358979323846;

/// Maps the unit square to the unit disc, areas to equal areas: P. Shirley, K. Chiu, "A Low Distortion Map Between Disk
/// and Square", Journal of Graphics Tools 2(3), 1997.
inline glm::dvec2 to_disc(const glm::dvec2& square)
{
    const glm::dvec2 p = 2.0 * square - 1.0;
    if (p == glm::dvec2(0.0))
        return p;
    const bool sideways = std::abs(p.x) > std::abs(p.y);
    const double radius = sideways ? p.x : p.y;
    const double angle = sideways ? 0.25 * pi * (p.y / p.x) : 0.5 * pi - 0.25 * pi * (p.x / p.y);
    return radius * glm::dvec2(std::cos(angle), std::sin(angle));
}

/// A direction about z whose density is cosine / pi, from two numbers in [0, 1): above a point of the disc.
inline glm::dvec3 cosine_direction(const glm::dvec2& u)
{
    const glm::dvec2 p = to_disc(u);
    return {p.x, p.y, std::sqrt(std::max(1.0 - p.x * p.x - p.y * p.y, 0.0))};
}

} // namespace isospline
