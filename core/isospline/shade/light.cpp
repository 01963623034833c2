#include "isospline/shade/light.h"

#include "isospline/util/check.h"

namespace isospline {

void validate(const Light& light)
{
    if (const auto* positional = std::get_if<PositionalLight>(&light)) {
        check_finite("position", positional->position);
        check_not_negative("intensity", positional->intensity);
    } else {
        const auto& directional = std::get<DirectionalLight>(light);
        check_direction("direction", directional.direction);
        check_not_negative("intensity", directional.intensity);
    }
}

std::vector<Light> camera_lights(const glm::dvec3& right, const glm::dvec3& up, const glm::dvec3& forward)
{
    return {DirectionalLight{right - 1.2 * up + forward, glm::dvec3(1.0)},
            DirectionalLight{-right + 0.25 * up + 0.6 * forward, glm::dvec3(0.25)}};
}

} // namespace isospline
