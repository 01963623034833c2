// Derivatives of hits by the level, the ray and the coefficients: docs/method.md, "Derivatives of hits".
#pragma once

#include "isospline/scene/scene_snapshot.h"
#include "isospline/spline/coefficient_weights.h"
#include "isospline/trace/hit.h"

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <span>

namespace isospline {

/// A ray grazes if the sine of its angle to the surface is smaller: derivatives grow like its inverse, and end where
/// the ray leaves the surface.
inline constexpr double grazing_sine = 0x1p-20;

/// Derivatives of t by the level and by the ray. All are zero for a ray that misses or grazes, and by the level for
/// what does not move with it: meshes and caps.
struct HitDerivatives {
    bool grazes = false;
    double by_level = 0.0;
    glm::dvec3 by_origin{0.0}, by_direction{0.0};
};
HitDerivatives derivatives_of(const Hit& hit, const glm::dvec3& direction, const SnapshotObject& object);

/// Derivatives of the unit normal: column j of a matrix is that by coordinate j.
struct NormalDerivatives {
    glm::dvec3 by_level{0.0};
    glm::dmat3 by_origin{0.0}, by_direction{0.0};
};
NormalDerivatives normal_derivatives_of(const Hit& hit, const glm::dvec3& direction, const SnapshotObject& object,
                                        const HitDerivatives& of_t);

/// The number of coefficients that influence a hit of the object: (n+1)^3, 0 for a mesh.
std::size_t coefficient_count(const SnapshotObject& object);

/// Sets their weights, with gradients in the space of the scene, and what is left of the span to zero. All are zero for
/// a hit that does not move with f, as on caps.
void set_coefficient_weights(const Hit& hit, const SnapshotObject& object, std::span<CoefficientWeight> weights);

} // namespace isospline
