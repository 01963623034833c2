// Lights with an area: soft shadows.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/shade/light_sample.h"
#include "isospline/util/value_class.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <optional>
#include <tuple>

namespace isospline {

/// A parallelogram that emits light on the side that edge_u x edge_v points to. It has no effect on the other side.
struct RectangleLight {
    glm::dvec3 corner{-0.5, -0.5, 0.0};
    glm::dvec3 edge_u{1.0, 0.0, 0.0}, edge_v{0.0, 1.0, 0.0};
    glm::dvec3 radiance{1.0}; ///< linear red, green and blue, in every direction
};

template <>
struct ValueClass<RectangleLight> {
    static constexpr char name[] = "RectangleLight";
    static constexpr std::tuple parameters{
        Parameter{"corner", &RectangleLight::corner}, Parameter{"edge_u", &RectangleLight::edge_u},
        Parameter{"edge_v", &RectangleLight::edge_v}, Parameter{"radiance", &RectangleLight::radiance}};
};

/// A ball that emits light.
struct SphereLight {
    glm::dvec3 center{0.0};
    double radius = 1.0;
    glm::dvec3 radiance{1.0}; ///< linear red, green and blue, in every direction
};

template <>
struct ValueClass<SphereLight> {
    static constexpr char name[] = "SphereLight";
    static constexpr std::tuple parameters{Parameter{"center", &SphereLight::center},
                                           Parameter{"radius", &SphereLight::radius},
                                           Parameter{"radiance", &SphereLight::radiance}};
};

/// Throw std::invalid_argument for numbers that are not finite, a negative radiance, parallel edges, and a radius
/// that is not positive.
void validate(const RectangleLight& light);
void validate(const SphereLight& light);

/// A direction from a point to the light, from two numbers in [0, 1); nothing if the point gets no light from it.
std::optional<LightSample> sample(const RectangleLight& light, const glm::dvec3& position, const glm::dvec2& u);
/// Uniform by solid angle in the cone of the ball.
std::optional<LightSample> sample(const SphereLight& light, const glm::dvec3& position, const glm::dvec2& u);

/// The light of a ray of unit direction, within its limits.
std::optional<Emission> emission(const RectangleLight& light, const Ray& ray);
std::optional<Emission> emission(const SphereLight& light, const Ray& ray);

} // namespace isospline
