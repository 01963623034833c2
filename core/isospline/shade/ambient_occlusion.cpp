#include "isospline/shade/ambient_occlusion.h"

#include "isospline/shade/opacity.h"
#include "isospline/util/check.h"

namespace isospline {

void validate(const AmbientOcclusion& occlusion)
{
    if (occlusion.samples < 1 || occlusion.samples > 65536)
        throw_invalid("samples", "rays a hit, from 1 to 65536", occlusion.samples);
    if (!(occlusion.distance > 0.0))
        throw_invalid("distance", "a number above 0", occlusion.distance);
    validate("color", occlusion.color);
    validate_opacity(occlusion);
    if (occlusion.cap_color)
        validate("cap_color", *occlusion.cap_color);
}

glm::dvec3 albedo(const AmbientOcclusion& occlusion, const SurfacePoint& point)
{
    return color_at(occlusion.color, occlusion.cap_color, point) * point.vertex_color;
}

glm::dvec3 shade(const AmbientOcclusion& occlusion, const SurfacePoint& point)
{
    return point.openness * albedo(occlusion, point);
}

} // namespace isospline
