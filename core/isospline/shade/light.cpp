#include "isospline/shade/light.h"

#include "isospline/math/frame.h"
#include "isospline/util/check.h"
#include "isospline/util/error.h"

#include <glm/geometric.hpp>

#include <cmath>

namespace isospline {

namespace {

/// The height of the cap of the unit sphere that a disc of this diameter in degrees covers: 1 - cosine.
double cap_height(double angle)
{
    const double half_sine = std::sin(0.25 * angle * pi / 180.0);
    return 2.0 * half_sine * half_sine;
}

} // namespace

void validate(const Light& light)
{
    if (const auto* positional = std::get_if<PositionalLight>(&light)) {
        check_finite("position", positional->position);
        check_not_negative("intensity", positional->intensity);
    } else {
        const auto& directional = std::get<DirectionalLight>(light);
        check_direction("direction", directional.direction);
        check_not_negative("intensity", directional.intensity);
        if (!(directional.angle >= 0.0 && directional.angle <= 180.0))
            throw_invalid("angle", "degrees from 0 to 180", directional.angle);
    }
}

glm::dvec3 DirectionalLight::to_point(const glm::dvec2& square) const
{
    if (angle == 0.0)
        return to_light;
    // A cap's area is proportional to its height.
    const double height = cap_height(angle);
    const glm::dvec2 on_disc = to_disc(square);
    const double here = height * glm::dot(on_disc, on_disc);
    return Frame(to_light).to_world(glm::dvec3(std::sqrt(height * (2.0 - here)) * on_disc, 1.0 - here));
}

double DirectionalLight::mean_cosine() const
{
    return 1.0 - 0.5 * cap_height(angle);
}

std::vector<Light> camera_lights(const glm::dvec3& right, const glm::dvec3& up, const glm::dvec3& forward)
{
    return {DirectionalLight{right - 1.2 * up + forward, glm::dvec3(1.0)},
            DirectionalLight{-right + 0.25 * up + 0.6 * forward, glm::dvec3(0.25)}};
}

} // namespace isospline
