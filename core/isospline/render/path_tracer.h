// The light that arrives at the camera on all paths: Monte Carlo integration of the rendering equation.
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

/// What gives light in a path traced picture. A PositionalLight's intensity is radiant intensity there, its light falls
/// off with the square of the distance; a DirectionalLight's is the irradiance of what faces it.
using Emitter = std::variant<PositionalLight, DirectionalLight, RectangleLight, SphereLight, EnvironmentLight>;

/// Paths from the camera: at each hit a light is chosen by chance and asked for a direction (next-event estimation),
/// the material draws another one that the path goes on in, and light that both find is weighted by the power heuristic
/// (E. Veach, "Robust Monte Carlo methods for light transport simulation", 1997). Dim paths end by Russian roulette.
///
/// Random numbers are a function of pixel, sample and seed: the picture is the same for any number of threads, bit for
/// bit. Materials are the same on both sides of a surface.
struct PathTracer {
    Material material;                                      ///< of objects that have none of their own
    std::map<std::uint32_t, Material> material_of_geometry; ///< by geometry id, instead of the object's own
    std::vector<Emitter> lights{EnvironmentLight{}};        ///< of environments one at most
    int max_bounces = 16;                                   ///< hits of a path that scatter; 0 shows nothing but lights
    std::uint32_t seed = 0;
};

/// Throws std::invalid_argument for what the validate() of its parts does, more than one EnvironmentLight, and a
/// negative number of bounces.
void validate(const PathTracer& path_tracer);

} // namespace isospline
