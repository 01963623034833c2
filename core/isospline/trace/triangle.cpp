#include "isospline/trace/triangle.h"

#include "isospline/math/expansion.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

namespace isospline {

namespace {

/// The error of a t in double precision, in units of the triangle's extent.
constexpr double largest_t_error = 0x1p-24;

using ExactVector = std::array<Expansion, 3>;

ExactVector exact(const glm::dvec3& v)
{
    return {Expansion(v.x), Expansion(v.y), Expansion(v.z)};
}

ExactVector exact_difference(const glm::dvec3& a, const glm::dvec3& b)
{
    return {Expansion::difference(a.x, b.x), Expansion::difference(a.y, b.y), Expansion::difference(a.z, b.z)};
}

ExactVector cross(const ExactVector& a, const ExactVector& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Expansion dot(const ExactVector& a, const ExactVector& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

int first_sign(const ExactVector& v)
{
    for (const Expansion& component : v)
        if (const int sign = component.sign(); sign != 0)
            return sign;
    return 0;
}

Expansion edge_function(const glm::dvec3& origin, const glm::dvec3& direction, const glm::dvec3& a, const glm::dvec3& b)
{
    return dot(exact(direction), cross(exact_difference(a, origin), exact_difference(b, origin)));
}

/// On which side of the edge from a to b a line passes; 0 if it is parallel to it.
int exact_side(const glm::dvec3& origin, const glm::dvec3& direction, const glm::dvec3& a, const glm::dvec3& b)
{
    if (const int sign = edge_function(origin, direction, a, b).sign(); sign != 0)
        return sign;
    // If the origin moves by m, det(d, a - o, b - o) grows by <m, (a - b) x d>.
    return first_sign(cross(exact_difference(a, b), exact(direction)));
}

/// The t at which a line meets a triangle's plane, as a quotient, and the derivatives of both with respect to the
/// origin.
struct ExactPlane {
    ExactPlane(const TriangleRay& ray, const Triangle& triangle)
        : normal(cross(exact_difference(triangle.b, triangle.a), exact_difference(triangle.c, triangle.a))),
          distance(dot(exact_difference(triangle.a, ray.origin), normal)), speed(dot(exact(ray.direction), normal))
    {
    }

    ExactVector normal;
    Expansion distance, speed;
};

/// Where a ray crosses a triangle, before the last roundings.
TriangleHit exact_hit(const TriangleRay& ray, const Triangle& triangle, Passage passage)
{
    const ExactPlane plane(ray, triangle);
    const double speed = plane.speed.rounded(), t = plane.distance.rounded() / speed * ray.scale;
    const auto weight = [&](const glm::dvec3& from, const glm::dvec3& to) {
        return edge_function(ray.origin, ray.direction, from, to).rounded() / speed;
    };
    return {t,
            0x1p-50 * std::abs(t),
            {weight(triangle.c, triangle.a), weight(triangle.a, triangle.b)},
            passage == Passage::against_normal};
}

} // namespace

TriangleRay::TriangleRay(const Ray& ray) : origin(ray.origin), t_near(ray.t_near), t_far(ray.t_far)
{
    // The power of two whose exponent is the opposite of that of the largest component.
    const double largest = std::max({std::abs(ray.direction.x), std::abs(ray.direction.y), std::abs(ray.direction.z)});
    constexpr std::uint64_t exponent_mask = 0x7ffull << 52, twice_the_bias = 2046ull << 52;
    scale = std::bit_cast<double>(twice_the_bias - (std::bit_cast<std::uint64_t>(largest) & exponent_mask));
    direction = ray.direction * scale;
}

Passage exact_passage(const glm::dvec3& origin, const glm::dvec3& direction, const Triangle& triangle)
{
    const int side = exact_side(origin, direction, triangle.a, triangle.b);
    if (side == 0 || exact_side(origin, direction, triangle.b, triangle.c) != side ||
        exact_side(origin, direction, triangle.c, triangle.a) != side)
        return Passage::none;
    return static_cast<Passage>(side);
}

TriangleHit triangle_hit(const TriangleRay& ray, const Triangle& triangle, Passage passage)
{
    // Computed from a point of the line close to the triangle, so that a distant origin costs little precision.
    const glm::dvec3& d = ray.direction;
    const double inverse_square = 1.0 / glm::dot(d, d);
    const glm::dvec3 to_middle = (triangle.a + triangle.b + triangle.c) / 3.0 - ray.origin;
    const double t_middle = glm::dot(to_middle, d) * inverse_square;
    const glm::dvec3 from = ray.origin + t_middle * d;
    const glm::dvec3 a = triangle.a - from, b = triangle.b - from, c = triangle.c - from;

    // Weights of the corners, clamped at zero: the exact ones are not negative.
    const auto sign = static_cast<double>(passage);
    const double weight_a = std::max(sign * glm::dot(glm::cross(d, b), c), 0.0);
    const double weight_b = std::max(sign * glm::dot(glm::cross(d, c), a), 0.0);
    const double weight_c = std::max(sign * glm::dot(glm::cross(d, a), b), 0.0);
    const double sum = weight_a + weight_b + weight_c;
    const double t_a = glm::dot(a, d) * inverse_square;
    const double t_b = glm::dot(b, d) * inverse_square;
    const double t_c = glm::dot(c, d) * inverse_square;

    // Positions have the rounding error of `from`, weights that of the edge functions as well.
    const auto size = [](const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); };
    const double extent = std::max({size(a), size(b), size(c)});
    const double place_error = 8.0 * 0x1p-53 * (size(ray.origin) + size(from) + extent);
    const double weight_error = 3.0 * extent * (edge_function_error * extent + 12.0 * place_error);
    const double t_range = std::max({t_a, t_b, t_c}) - std::min({t_a, t_b, t_c});
    const double t_error = t_range * (2.0 * weight_error / sum) + 8.0 * place_error;
    const double t = t_middle + (weight_a * t_a + weight_b * t_b + weight_c * t_c) / sum;
    // A ray that begins on the triangle meets it at 0.
    if (!(weight_error < 0.5 * sum && t_error < largest_t_error * extent && std::abs(t) > t_error))
        return exact_hit(ray, triangle, passage);
    return {t * ray.scale, t_error * ray.scale, {weight_b / sum, weight_c / sum}, passage == Passage::against_normal};
}

std::optional<TriangleHit> triangle_touch(const TriangleRay& ray, const Triangle& triangle)
{
    const auto size = [](const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); };
    const glm::dvec3& d = ray.direction;
    const double inverse_square = 1.0 / glm::dot(d, d);
    const double tolerance =
        touch_tolerance * (size(ray.origin) + std::max({size(triangle.a), size(triangle.b), size(triangle.c)}));

    // The corners: t of the nearest point of the line, and the way from there to the corner.
    const std::array<glm::dvec3, 3> corners{triangle.a - ray.origin, triangle.b - ray.origin, triangle.c - ray.origin};
    std::array<double, 3> t_corner{};
    std::array<glm::dvec3, 3> beside{};
    for (std::size_t i = 0; i < 3; ++i) {
        t_corner[i] = glm::dot(corners[i], d) * inverse_square;
        beside[i] = corners[i] - t_corner[i] * d;
    }

    // The nearest place of the edges, and how wide the triangle is as seen along the line.
    double nearest = std::numeric_limits<double>::infinity(), t = 0.0, longest = 0.0;
    glm::dvec2 uv(0.0);
    constexpr std::array<glm::dvec2, 3> uv_corner{glm::dvec2(0.0, 0.0), glm::dvec2(1.0, 0.0), glm::dvec2(0.0, 1.0)};
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t next = (i + 1) % 3;
        const glm::dvec3 edge = beside[next] - beside[i];
        const double square = glm::dot(edge, edge);
        longest = std::max(longest, std::sqrt(square));
        const double s = square > 0.0 ? std::clamp(-glm::dot(beside[i], edge) / square, 0.0, 1.0) : 0.0;
        if (const double distance = glm::length(beside[i] + s * edge); distance < nearest) {
            nearest = distance;
            t = glm::mix(t_corner[i], t_corner[next], s);
            uv = glm::mix(uv_corner[i], uv_corner[next], s);
        }
    }
    const glm::dvec3 seen = glm::cross(beside[1] - beside[0], beside[2] - beside[0]);
    if (!(nearest <= tolerance) || glm::length(seen) <= 2.0 * tolerance * longest)
        return std::nullopt;

    const double t_error = tolerance * std::sqrt(inverse_square) * ray.scale;
    t *= ray.scale;
    if (t < ray.t_near - t_error || t > ray.t_far + t_error)
        return std::nullopt;
    return TriangleHit{std::clamp(t, ray.t_near, ray.t_far), t_error, uv, glm::dot(seen, d) < 0.0};
}

std::weak_ordering exact_order(const TriangleRay& ray, const Triangle& first, const Triangle& second)
{
    const ExactPlane p(ray, first), q(ray, second);
    const int side = p.speed.sign() * q.speed.sign();
    if (const int sign = side * (p.distance * q.speed - q.distance * p.speed).sign(); sign != 0)
        return sign <=> 0;
    // If the origin moves by m, a distance shrinks by <m, normal>.
    ExactVector difference;
    for (std::size_t axis = 0; axis < 3; ++axis)
        difference[axis] = q.normal[axis] * p.speed - p.normal[axis] * q.speed;
    return side * first_sign(difference) <=> 0;
}

} // namespace isospline
