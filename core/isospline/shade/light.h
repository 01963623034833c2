// Lights: their positions and intensities.
#pragma once

#include "isospline/util/value_class.h"

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <tuple>
#include <variant>
#include <vector>

namespace isospline {

/// A light at a point in world space; like the paper (§6), without attenuation by distance.
struct PositionalLight {
    glm::dvec3 position{0.0};
    glm::dvec3 intensity{1.0}; ///< linear red, green and blue
};

template <>
struct ValueClass<PositionalLight> {
    static constexpr char name[] = "PositionalLight";
    static constexpr std::tuple parameters{Parameter{"position", &PositionalLight::position},
                                           Parameter{"intensity", &PositionalLight::intensity}};
};

/// A light at infinity: a point, or an evenly bright disc like the sun.
struct DirectionalLight {
    explicit DirectionalLight(const glm::dvec3& given_direction = {0.0, 0.0, -1.0},
                              const glm::dvec3& given_intensity = glm::dvec3(1.0), double given_angle = 0.0)
        : direction(given_direction), intensity(given_intensity), angle(given_angle),
          to_light(-glm::normalize(given_direction))
    {
    }

    /// The unit direction to the point of the disc that a point of the unit square is mapped to. Equal areas have equal
    /// solid angles.
    glm::dvec3 to_point(const glm::dvec2& square) const;
    /// The mean cosine of the angle between the disc's points and its centre: what a surface that faces the centre
    /// receives, as a part of what it would receive from the centre alone.
    double mean_cosine() const;

    glm::dvec3 direction; ///< in which the light travels, of any length
    glm::dvec3 intensity; ///< linear red, green and blue
    double angle;         ///< the disc's diameter as seen from the scene, degrees; 0 for a point
    glm::dvec3 to_light;  ///< unit, the opposite direction, computed once
};

template <>
struct ValueClass<DirectionalLight> {
    static constexpr char name[] = "DirectionalLight";
    static constexpr std::tuple parameters{Parameter{"direction", &DirectionalLight::direction},
                                           Parameter{"intensity", &DirectionalLight::intensity},
                                           Parameter{"angle", &DirectionalLight::angle}};
};

using Light = std::variant<PositionalLight, DirectionalLight>;

/// Throws std::invalid_argument for a number that is not finite, a negative intensity, a direction of zero, or an angle
/// that is negative or above 180.
void validate(const Light& light);

/// Two directional lights that move with the viewer, for pictures without lights of their own: a key light over the
/// left shoulder and a fill light of a quarter of its intensity from the right. `right`, `up` and `forward` are the
/// unit axes of the image.
std::vector<Light> camera_lights(const glm::dvec3& right, const glm::dvec3& up, const glm::dvec3& forward);

} // namespace isospline
