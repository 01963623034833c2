// The thickness of the solid that an isosurface bounds, at points of its surface.
#pragma once

#include "isospline/scene/scene_snapshot.h"

#include <glm/vec3.hpp>

#include <memory>
#include <span>

namespace isospline {

enum class ThicknessMethod {
    ray,       ///< length of the inward normal in the solid
    max_sphere ///< diameter of the largest ball in the solid that touches the surface there
};

/// Computes the thickness at the points of the surface that are nearest to the given points in world space. It is
/// infinite if there is no opposite side. `scene` contains only the surface, with id 0.
///
/// Shrinking balls: J. Ma, S. W. Bae, S. Choi, "3D medial axis point approximation using nearest neighbors and the
/// normal field", The Visual Computer 28, 2012. The first ball contains the largest one. The point of the surface
/// nearest to a ball's centre gives the next ball, which touches that point. The last ball contains no point of the
/// surface.
void find_thickness(const SceneSnapshot& scene, const IsosurfaceSnapshot& surface, ThicknessMethod method,
                    std::span<const glm::dvec3> points_world, std::span<double> thickness);

} // namespace isospline
