// Derivatives of hits by the level, the ray and the coefficients: docs/method.md, "Derivatives of hits".
#pragma once

#include "isospline/scene/scene_snapshot.h"
#include "isospline/spline/coefficient_weights.h"
#include "isospline/trace/hit.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace isospline {

/// A ray grazes if the sine of its angle to the surface is smaller: derivatives grow like its inverse, and end where
/// the ray leaves the surface.
inline constexpr double grazing_sine = 0x1p-20;

/// Whether the ray of a hit grazes. Without a root: it is asked for each hit.
inline bool is_grazing(const Hit& hit, const glm::dvec3& direction)
{
    const double along = glm::dot(hit.normal, direction);
    return !(along * along >= grazing_sine * grazing_sine * glm::dot(direction, direction));
}

/// The derivative of t by the origin, for a hit that does not graze. That by the direction is t times as large.
inline glm::dvec3 t_by_origin(const Hit& hit, const glm::dvec3& direction)
{
    return -hit.normal / glm::dot(hit.normal, direction);
}

/// Derivatives of the unit normal: column j of a matrix is that by coordinate j.
struct NormalDerivatives {
    glm::dvec3 by_level{0.0};
    glm::dmat3 by_origin{0.0}, by_direction{0.0};
};

/// Derivatives of hits of one object, by what it is made of. They are zero for hits that do not move with f: on caps
/// and meshes. It refers to the object.
class HitDerivatives {
public:
    HitDerivatives() = default; ///< of nothing: all are zero
    explicit HitDerivatives(const SnapshotObject& object);

    /// The derivative of t by the level, 1 / <gradient of f, direction>, for a hit that does not graze.
    double t_by_level(const Hit& hit, const glm::dvec3& direction) const
    {
        // The gradient is against the outward normal if the inner side is above the level.
        return moves(hit) ? -inward_sign_ / (hit.gradient_magnitude * glm::dot(hit.normal, direction)) : 0.0;
    }

    /// For a hit that does not graze.
    NormalDerivatives of_normal(const Hit& hit, const glm::dvec3& direction) const;

    /// Sets the weights of the coefficients that influence a hit, with gradients in the space of the scene, and what is
    /// left of the span to zero.
    void set_coefficient_weights(const Hit& hit, std::span<CoefficientWeight> weights) const;

private:
    bool moves(const Hit& hit) const { return hit.primitive_id < cell_count_; } // caps follow the cells

    const Volume* volume_ = nullptr;
    std::uint64_t cell_count_ = 0; ///< 0 for meshes
    double inward_sign_ = 0.0;
    glm::dmat4 from_scene_{1.0}, to_index_{1.0};
};

/// The number of coefficients that influence a hit of the object: (n+1)^3, 0 for a mesh.
std::size_t coefficient_count(const SnapshotObject& object);

} // namespace isospline
