// On which side of a line or a plane a point is, decided exactly.
#pragma once

#include "isospline/math/expansion.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cmath>

namespace isospline {

/// The sign of det(b - a, c - a): 1 if a, b, c turn left. Shewchuk's error bound decides most cases.
inline int orientation(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c)
{
    constexpr double relative_error = 4.0 * 0x1p-53; // (3 + 16 u) u
    const double left = (a.x - c.x) * (b.y - c.y), right = (a.y - c.y) * (b.x - c.x);
    const double determinant = left - right, error = relative_error * (std::abs(left) + std::abs(right));
    if (determinant > error || determinant < -error)
        return determinant > 0.0 ? 1 : -1;
    const auto minus = [](double p, double q) { return Expansion::difference(p, q); };
    return (minus(a.x, c.x) * minus(b.y, c.y) - minus(a.y, c.y) * minus(b.x, c.x)).sign();
}

/// The sign of det(a - d, b - d, c - d): 1 if a, b, c turn right as seen from d.
inline int orientation(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d)
{
    constexpr double relative_error = 8.0 * 0x1p-53; // (7 + 56 u) u
    const glm::dvec3 p = a - d, q = b - d, r = c - d;
    const double qr = q.x * r.y, rq = r.x * q.y, rp = r.x * p.y, pr = p.x * r.y, pq = p.x * q.y, qp = q.x * p.y;
    const double determinant = p.z * (qr - rq) + q.z * (rp - pr) + r.z * (pq - qp);
    const double error = relative_error * ((std::abs(qr) + std::abs(rq)) * std::abs(p.z) +
                                           (std::abs(rp) + std::abs(pr)) * std::abs(q.z) +
                                           (std::abs(pq) + std::abs(qp)) * std::abs(r.z));
    if (determinant > error || determinant < -error)
        return determinant > 0.0 ? 1 : -1;
    const auto minus = [](double s, double t) { return Expansion::difference(s, t); };
    const Expansion px = minus(a.x, d.x), py = minus(a.y, d.y), qx = minus(b.x, d.x), qy = minus(b.y, d.y),
                    rx = minus(c.x, d.x), ry = minus(c.y, d.y);
    return (minus(a.z, d.z) * (qx * ry - rx * qy) + minus(b.z, d.z) * (rx * py - px * ry) +
            minus(c.z, d.z) * (px * qy - qx * py))
        .sign();
}

} // namespace isospline
