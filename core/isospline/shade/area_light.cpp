#include "isospline/shade/area_light.h"

#include "isospline/math/frame.h"
#include "isospline/util/check.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

namespace {

/// The cone of directions from a point to a ball; nothing from inside of it.
struct Cone {
    Cone(const SphereLight& light, const glm::dvec3& position) : to_center(light.center - position)
    {
        distance = glm::length(to_center);
        inside = distance <= light.radius;
        if (inside)
            return;
        const double sine = light.radius / distance;
        sine_squared = sine * sine;
        // 1 - cosine, without cancellation for small or distant balls.
        one_less_cosine = sine_squared / (1.0 + std::sqrt(1.0 - sine_squared));
        density = 1.0 / (2.0 * pi * one_less_cosine);
    }

    glm::dvec3 to_center;
    double distance = 0.0, sine_squared = 1.0, one_less_cosine = 2.0, density = 1.0 / (4.0 * pi);
    bool inside = false;
};

} // namespace

void validate(const RectangleLight& light)
{
    check_finite("corner", light.corner);
    check_direction("edge_u", light.edge_u);
    check_direction("edge_v", light.edge_v);
    const double area = glm::length(glm::cross(light.edge_u, light.edge_v));
    if (!(area > 1e-12 * glm::length(light.edge_u) * glm::length(light.edge_v)))
        throw_invalid("edge_v", "an edge that spans a plane with edge_u", to_text(light.edge_v));
    check_not_negative("radiance", light.radiance);
}

void validate(const SphereLight& light)
{
    check_finite("center", light.center);
    check_positive("radius", light.radius);
    check_not_negative("radiance", light.radiance);
}

std::optional<LightSample> sample(const RectangleLight& light, const glm::dvec3& position, const glm::dvec2& u)
{
    const glm::dvec3 offset = light.corner + u.x * light.edge_u + u.y * light.edge_v - position;
    const glm::dvec3 area = glm::cross(light.edge_u, light.edge_v);
    const double distance = glm::length(offset);
    // Cosine at the light, times its area.
    const double facing = -glm::dot(area, offset) / distance;
    if (!(facing > 0.0))
        return std::nullopt;
    const double density = distance * distance / facing;
    return LightSample{offset / distance, distance, light.radiance / density, density};
}

std::optional<Emission> emission(const RectangleLight& light, const Ray& ray)
{
    const glm::dvec3 area = glm::cross(light.edge_u, light.edge_v);
    const double facing = -glm::dot(area, ray.direction);
    if (!(facing > 0.0))
        return std::nullopt;
    const double t = glm::dot(area, ray.origin - light.corner) / facing;
    if (!(t >= ray.t_near && t <= ray.t_far))
        return std::nullopt;
    const glm::dvec3 place = ray.at(t) - light.corner;
    const double squared_area = glm::dot(area, area);
    const double u = glm::dot(glm::cross(place, light.edge_v), area) / squared_area;
    const double v = glm::dot(glm::cross(light.edge_u, place), area) / squared_area;
    if (!(u >= 0.0 && u <= 1.0 && v >= 0.0 && v <= 1.0))
        return std::nullopt;
    return Emission{t, light.radiance, t * t / facing};
}

std::optional<LightSample> sample(const SphereLight& light, const glm::dvec3& position, const glm::dvec2& u)
{
    const Cone cone(light, position);
    const double less = u.x * cone.one_less_cosine, cosine = 1.0 - less;
    const double sine = std::sqrt(std::max(less * (2.0 - less), 0.0));
    const glm::dvec3 axis = cone.distance > 0.0 ? cone.to_center / cone.distance : glm::dvec3(0.0, 0.0, 1.0);
    const double angle = 2.0 * pi * u.y;
    const glm::dvec3 direction = Frame(axis).to_world({sine * std::cos(angle), sine * std::sin(angle), cosine});
    const double half_chord =
        std::sqrt(std::max(light.radius * light.radius - cone.distance * cone.distance * sine * sine, 0.0));
    const double distance = cone.distance * cosine + (cone.inside ? half_chord : -half_chord);
    return LightSample{direction, distance, light.radiance / cone.density, cone.density};
}

std::optional<Emission> emission(const SphereLight& light, const Ray& ray)
{
    const Cone cone(light, ray.origin);
    const double along = glm::dot(cone.to_center, ray.direction);
    const glm::dvec3 closest = cone.to_center - along * ray.direction;
    const double squared_half_chord = light.radius * light.radius - glm::dot(closest, closest);
    if (!(squared_half_chord >= 0.0))
        return std::nullopt;
    const double t = along + (cone.inside ? 1.0 : -1.0) * std::sqrt(squared_half_chord);
    if (!(t >= ray.t_near && t <= ray.t_far))
        return std::nullopt;
    return Emission{t, light.radiance, cone.density};
}

} // namespace isospline
