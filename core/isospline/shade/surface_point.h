// What an illumination model is told about the point that it shades.
#pragma once

#include "isospline/spline/curvature.h"

#include <glm/vec3.hpp>

#include <span>

namespace isospline {

struct SurfacePoint {
    glm::dvec3 position{0.0};            ///< x0, world space
    glm::dvec3 normal{0.0, 0.0, 1.0};    ///< N, unit, outward
    glm::dvec3 to_viewer{0.0, 0.0, 1.0}; ///< V, unit, against the ray
    double depth = 0.0;                  ///< as Projection::depth()
    glm::dvec3 vertex_color{1.0};        ///< of a mesh that has one, linear; the surface's colour is multiplied by it
    Curvature curvature = {};            ///< of an isosurface, world space
    bool on_cap = false;                 ///< of a capped cut of an isosurface
    std::span<const double> lit{};       ///< the part of each of the model's lights that gets here; empty if all of it
    double openness = 1.0;               ///< as AmbientOcclusion's integral over pi
};

} // namespace isospline
