// How thick the solid that an isosurface bounds is, at points of its surface.
#pragma once

#include "isospline/scene/scene_snapshot.h"

#include <glm/vec3.hpp>

#include <memory>
#include <span>

namespace isospline {

enum class ThicknessMethod {
    ray,       ///< along the inward normal, to where that leaves the solid
    max_sphere ///< diameter of the largest ball in the solid that touches the surface there
};

/// At the points of the surface that are nearest to points in world space. Infinite where there is no other side.
/// `scene` has the surface alone, under id 0.
///
/// Balls shrink: J. Ma, S. W. Bae, S. Choi, "3D medial axis point approximation using nearest neighbors and the normal
/// field", The Visual Computer 28, 2012. From one that holds the largest, the nearest point of the surface to its
/// centre gives the next, which touches that point; the last is empty.
void find_thickness(const SceneSnapshot& scene, const IsosurfaceSnapshot& surface, ThicknessMethod method,
                    std::span<const glm::dvec3> points_world, std::span<double> thickness);

} // namespace isospline
