#include "isospline/render/appearances.h"

#include "isospline/render/projection.h"
#include "isospline/render/visibility.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/util/error.h"

#include <variant>

namespace isospline {

Appearances::Appearances(const SceneSnapshot& scene, const Look& look, const Projection& projection,
                         const DepthRange& depths)
    : others_(prepared(look.shading, projection, depths))
{
    for (const auto& [geometry_id, shading] : look.shading_of_geometry) {
        if (!scene.contains(geometry_id))
            throw_invalid("shading", "geometry ids of objects in the scene", geometry_id);
        of_geometry_.emplace(geometry_id, prepared(shading, projection, depths));
    }
}

Appearance Appearances::prepared(Shading shading, const Projection& projection, const DepthRange& depths)
{
    validate(shading);
    fit_depth_limits(shading, depths);
    if (auto* phong = std::get_if<Phong>(&shading); phong && !phong->lights)
        phong->lights = camera_lights(projection.right(), projection.up(), projection.forward());
    needs_visibility_ = needs_visibility_ || Visibility::is_needed_by(shading);
    const std::optional<double> opacity = even_opacity(shading);
    all_opaque_ = all_opaque_ && opacity == 1.0;
    return {shading, opacity, needs_curvature(shading)};
}

} // namespace isospline
