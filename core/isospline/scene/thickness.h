// The thickness of the solid that an isosurface bounds, at points of its surface.
#pragma once

#include "isospline/scene/scene_snapshot.h"

#include <glm/vec3.hpp>

#include <memory>
#include <span>

namespace isospline {

enum class ThicknessMethod {
    ray,       ///< length of the inward normal in the solid
    max_sphere ///< diameter of the largest ball in the solid that is nearer to the point than the height of ripples
};

/// Computes the thickness at the points of the surface that are nearest to the given points in world space. It is
/// infinite if there is no opposite side. `scene` contains only the surface, with id 0. Balls are found by
/// inscribed_ball(); `ripple` is the gap there. Their radii are precise to 0.02 ripple, kept
/// between a thousandth and a hundredth of the shortest edge of a cell.
void find_thickness(const SceneSnapshot& scene, const IsosurfaceSnapshot& surface, ThicknessMethod method,
                    double ripple, std::span<const glm::dvec3> points_world, std::span<double> thickness);

} // namespace isospline
