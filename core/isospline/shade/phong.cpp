#include "isospline/shade/phong.h"

#include "isospline/math/power.h"
#include "isospline/util/check.h"

#include <algorithm>
#include <cstddef>

namespace isospline {

void validate(const Phong& phong)
{
    validate("color", phong.color);
    check_not_negative("ambient", phong.ambient);
    check_not_negative("diffuse", phong.diffuse);
    check_not_negative("specular", phong.specular);
    check_not_negative("specular_exponent", phong.specular_exponent);
    check_not_negative("ambient_light", phong.ambient_light);
    check_fraction("opacity", phong.opacity);
    if (phong.cap_color)
        validate("cap_color", *phong.cap_color);
    if (phong.lights)
        for (const Light& light : *phong.lights)
            validate(light);
}

glm::dvec3 albedo(const Phong& phong, const SurfacePoint& point)
{
    return color_at(phong.color, phong.cap_color, point) * point.vertex_color;
}

glm::dvec3 shade(const Phong& phong, const SurfacePoint& point)
{
    const glm::dvec3 surface_color = albedo(phong, point);
    const glm::dvec3& v = point.to_viewer;
    const bool away = glm::dot(point.normal, v) < 0.0;
    const glm::dvec3 n = phong.two_sided && away ? -point.normal : point.normal;
    const double n_v = glm::dot(n, v);

    glm::dvec3 color = phong.ambient * phong.ambient_light * surface_color;
    if (!phong.lights)
        return color;
    for (std::size_t k = 0; k < phong.lights->size(); ++k) {
        const double lit = point.lit.empty() ? 1.0 : point.lit[k];
        if (lit == 0.0)
            continue;
        const auto add = [&](const auto& source) {
            const glm::dvec3 l = direction_to(source, point.position);
            const double n_l = glm::dot(n, l);
            const double v_r = 2.0 * n_l * n_v - glm::dot(l, v); // of R = 2 <N, L> N - L
            color += lit * source.intensity * phong.diffuse * std::max(n_l, 0.0) * surface_color;
            // Zero stays dark also at an exponent of zero, where 0^0 would light it.
            if (v_r > 0.0)
                color += lit * source.intensity * phong.specular * power(v_r, phong.specular_exponent);
        };
        std::visit(add, (*phong.lights)[k]);
    }
    return color;
}

} // namespace isospline
