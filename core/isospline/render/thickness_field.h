// The thickness of a solid at points of its surface, for colours.
#pragma once

#include "isospline/math/affine.h"
#include "isospline/scene/thickness.h"
#include "isospline/shade/color.h"

#include <glm/mat4x4.hpp>

#include <memory>
#include <span>
#include <utility>
#include <variant>

namespace isospline {

/// The thickness by find_thickness(), of a surface that a similarity places in the scene.
class ThicknessField : public PointValue {
public:
    /// `surface` contains only the surface, with id 0. `scene_to_surface` maps the scene's world space to the surface's
    /// and divides lengths by `scale`.
    ThicknessField(std::shared_ptr<const SceneSnapshot> surface, ThicknessMethod method, double ripple,
                   const glm::dmat4& scene_to_surface, double scale)
        : surface_(std::move(surface)), method_(method), ripple_(ripple), scene_to_surface_(scene_to_surface),
          scale_(scale)
    {
    }

    double at(const glm::dvec3& position_world) const override
    {
        const glm::dvec3 position = transform_point(scene_to_surface_, position_world);
        const auto& shown = *std::get<std::shared_ptr<const IsosurfaceSnapshot>>(surface_->object(0).object);
        double thickness = 0.0;
        find_thickness(*surface_, shown, method_, ripple_, std::span(&position, 1), std::span(&thickness, 1));
        return scale_ * thickness;
    }

private:
    std::shared_ptr<const SceneSnapshot> surface_;
    ThicknessMethod method_;
    double ripple_;
    glm::dmat4 scene_to_surface_;
    double scale_;
};

} // namespace isospline
