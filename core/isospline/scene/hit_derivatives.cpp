#include "isospline/scene/hit_derivatives.h"

#include "isospline/math/affine.h"
#include "isospline/spline/sample.h"

#include <glm/matrix.hpp>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <variant>

namespace isospline {

namespace {

/// Null for a mesh.
const IsosurfaceSnapshot* isosurface_of(const SnapshotObject& object)
{
    const auto* const surface = std::get_if<std::shared_ptr<const IsosurfaceSnapshot>>(&object.object);
    return surface == nullptr ? nullptr : surface->get();
}

} // namespace

HitDerivatives::HitDerivatives(const SnapshotObject& object)
{
    if (const IsosurfaceSnapshot* const surface = isosurface_of(object)) {
        volume_ = &surface->volume();
        cell_count_ = volume_->cell_count();
        inward_sign_ = surface->inward_sign();
        from_scene_ = glm::inverse(object.transform);
        to_index_ = volume_->world_to_index() * from_scene_;
    }
}

NormalDerivatives HitDerivatives::of_normal(const Hit& hit, const glm::dvec3& direction) const
{
    NormalDerivatives result;
    if (!moves(hit))
        return result;
    const glm::dmat3 linear(from_scene_);
    const glm::dmat3 hessian =
        glm::transpose(linear) * hessian_at(*volume_, transform_point(from_scene_, hit.position)) * linear;
    const glm::dmat3 tangent = glm::dmat3(1.0) - glm::outerProduct(hit.normal, hit.normal);
    const glm::dmat3 by_position = tangent * hessian * (-inward_sign_ / hit.gradient_magnitude);
    // The point moves by d origin + t d direction + direction dt.
    result.by_level = by_position * direction * t_by_level(hit, direction);
    result.by_origin = by_position * (glm::dmat3(1.0) + glm::outerProduct(direction, t_by_origin(hit, direction)));
    result.by_direction = result.by_origin * hit.t;
    return result;
}

void HitDerivatives::set_coefficient_weights(const Hit& hit, std::span<CoefficientWeight> weights) const
{
    std::fill(weights.begin(), weights.end(), CoefficientWeight());
    if (moves(hit))
        isospline::set_coefficient_weights(*volume_, volume_->cell_at(hit.primitive_id),
                                           transform_point(to_index_, hit.position), to_index_, weights);
}

std::size_t coefficient_count(const SnapshotObject& object)
{
    const IsosurfaceSnapshot* const surface = isosurface_of(object);
    return surface == nullptr ? 0 : coefficient_count(surface->volume());
}

} // namespace isospline
