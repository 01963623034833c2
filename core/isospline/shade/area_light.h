// Lights with an area: soft shadows.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/shade/light_sample.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <optional>

namespace isospline {

/// A parallelogram that gives light to the side that edge_u x edge_v points to, and none, and no shadow, to the other.
struct RectangleLight {
    glm::dvec3 corner{-0.5, -0.5, 0.0};
    glm::dvec3 edge_u{1.0, 0.0, 0.0}, edge_v{0.0, 1.0, 0.0};
    glm::dvec3 radiance{1.0}; ///< linear red, green and blue, in every direction
};

/// A ball that gives light.
struct SphereLight {
    glm::dvec3 center{0.0};
    double radius = 1.0;
    glm::dvec3 radiance{1.0}; ///< linear red, green and blue, in every direction
};

/// Throw std::invalid_argument for numbers that are not finite, a negative radiance, edges along one line, and a radius
/// that is not positive.
void validate(const RectangleLight& light);
void validate(const SphereLight& light);

/// A direction from a point to the light, from two numbers in [0, 1); nothing where it gives the point no light.
std::optional<LightSample> sample(const RectangleLight& light, const glm::dvec3& position, const glm::dvec2& u);
/// By solid angle, of the cone that the ball fills.
std::optional<LightSample> sample(const SphereLight& light, const glm::dvec3& position, const glm::dvec2& u);

/// The light of a ray of unit direction, within its limits.
std::optional<Emission> emission(const RectangleLight& light, const Ray& ray);
std::optional<Emission> emission(const SphereLight& light, const Ray& ray);

} // namespace isospline
