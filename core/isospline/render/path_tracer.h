// Monte Carlo path tracing: integration of the rendering equation.
#pragma once

#include "isospline/shade/area_light.h"
#include "isospline/shade/environment_light.h"
#include "isospline/shade/light.h"
#include "isospline/shade/material.h"

#include <cstdint>
#include <map>
#include <variant>
#include <vector>

namespace isospline {

/// The lights of path traced pictures. The intensity of a PositionalLight is a radiant intensity, and its light falls
/// off with the square of the distance; that of a DirectionalLight is the irradiance of surfaces that face it.
using Emitter = std::variant<PositionalLight, DirectionalLight, RectangleLight, SphereLight, EnvironmentLight>;

/// Paths start at the camera. At each hit, a random light gives a direction (next-event estimation), the material draws
/// another one in which the path continues, and light found by both is weighted by the power heuristic
/// (E. Veach, "Robust Monte Carlo methods for light transport simulation", 1997). Dim paths end by Russian roulette.
///
/// Random numbers are a function of pixel, sample and seed: the picture is the same for any number of threads, bit for
/// bit. Materials are the same on both sides of a surface.
struct PathTracer {
    Material material;                                      ///< of objects without one of their own
    std::map<std::uint32_t, Material> material_of_geometry; ///< by geometry id, instead of the object's own
    std::vector<Emitter> lights{EnvironmentLight{}};        ///< at most one environment
    int max_bounces = 16; ///< largest number of scattering hits of a path; 0 shows lights only
    std::uint32_t seed = 0;
};

/// Throws std::invalid_argument like validate() of its parts, and for more than one EnvironmentLight or a negative
/// number of bounces.
void validate(const PathTracer& path_tracer);

} // namespace isospline
