// The input of an illumination model: a point to shade.
#pragma once

#include "isospline/spline/curvature.h"

#include <glm/vec3.hpp>

#include <cmath>
#include <span>

namespace isospline {

struct SurfacePoint {
    glm::dvec3 position{0.0};            ///< x0, world space
    glm::dvec3 normal{0.0, 0.0, 1.0};    ///< N, unit, outward
    glm::dvec3 to_viewer{0.0, 0.0, 1.0}; ///< V, unit, against the ray
    double depth = 0.0;                  ///< as Projection::depth()
    glm::dvec3 vertex_color{1.0};        ///< of a mesh with vertex colours, linear; multiplies the surface's colour
    double value = std::nan("");         ///< of a mesh with values at its vertices; NaN without
    Curvature curvature = {};            ///< of an isosurface, world space
    bool on_cap = false;                 ///< of a capped cut of an isosurface
    std::span<const double> lit{};       ///< the transmitted part of each of the model's lights; empty if all of it
    double openness = 1.0;               ///< as AmbientOcclusion's integral over pi
};

} // namespace isospline
