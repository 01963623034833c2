// The model and its derivatives in world space.
#pragma once

#include "isospline/math/affine.h"
#include "isospline/spline/volume.h"

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

namespace isospline {

/// f at a point in world space.
inline double value_at(const Volume& volume, const glm::dvec3& position_world)
{
    return volume.value(transform_point(volume.world_to_index(), position_world));
}

/// Gradient of f by world coordinates: J^-T times the gradient by index coordinates, where J is the linear part of
/// index_to_world.
inline glm::dvec3 gradient_at(const Volume& volume, const glm::dvec3& position_world)
{
    const auto& to_index = volume.world_to_index();
    return transform_gradient(to_index, volume.gradient(transform_point(to_index, position_world)));
}

/// Hessian of f by world coordinates, J^-T H J^-1.
inline glm::dmat3 hessian_at(const Volume& volume, const glm::dvec3& position_world)
{
    const auto& to_index = volume.world_to_index();
    const glm::dmat3 inverse(to_index);
    return glm::transpose(inverse) * volume.hessian(transform_point(to_index, position_world)) * inverse;
}

} // namespace isospline
