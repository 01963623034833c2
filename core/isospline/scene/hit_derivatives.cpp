#include "isospline/scene/hit_derivatives.h"

#include "isospline/math/affine.h"
#include "isospline/spline/sample.h"

#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <variant>

namespace isospline {

namespace {

/// The isosurface of a hit on it, not on a cap; null for others.
const IsosurfaceSnapshot* surface_of(const Hit& hit, const SnapshotObject& object)
{
    const auto* const surface = std::get_if<std::shared_ptr<const IsosurfaceSnapshot>>(&object.object);
    return surface != nullptr && !(*surface)->is_cap(hit.primitive_id) ? surface->get() : nullptr;
}

} // namespace

HitDerivatives derivatives_of(const Hit& hit, const glm::dvec3& direction, const SnapshotObject& object)
{
    HitDerivatives result;
    if (!hit)
        return result;
    const double along = glm::dot(hit.normal, direction);
    result.grazes = !(std::abs(along) >= grazing_sine * glm::length(direction));
    if (result.grazes)
        return result;
    result.by_origin = -hit.normal / along;
    result.by_direction = hit.t * result.by_origin;
    // The gradient is against the outward normal if the inner side is above the level.
    if (const IsosurfaceSnapshot* const surface = surface_of(hit, object))
        result.by_level = -surface->inward_sign() / (hit.gradient_magnitude * along);
    return result;
}

NormalDerivatives normal_derivatives_of(const Hit& hit, const glm::dvec3& direction, const SnapshotObject& object,
                                        const HitDerivatives& of_t)
{
    NormalDerivatives result;
    const IsosurfaceSnapshot* const surface = hit ? surface_of(hit, object) : nullptr;
    if (surface == nullptr || of_t.grazes)
        return result;
    const glm::dmat4 from_scene = glm::inverse(object.transform);
    const glm::dmat3 linear(from_scene);
    const glm::dmat3 hessian =
        glm::transpose(linear) * hessian_at(surface->volume(), transform_point(from_scene, hit.position)) * linear;
    const glm::dmat3 tangent = glm::dmat3(1.0) - glm::outerProduct(hit.normal, hit.normal);
    const glm::dmat3 by_position = tangent * hessian * (-surface->inward_sign() / hit.gradient_magnitude);
    // The point moves by d origin + t d direction + direction dt.
    result.by_level = by_position * direction * of_t.by_level;
    result.by_origin = by_position * (glm::dmat3(1.0) + glm::outerProduct(direction, of_t.by_origin));
    result.by_direction = result.by_origin * hit.t;
    return result;
}

std::size_t coefficient_count(const SnapshotObject& object)
{
    const auto* const surface = std::get_if<std::shared_ptr<const IsosurfaceSnapshot>>(&object.object);
    return surface == nullptr ? 0 : coefficient_count((*surface)->volume());
}

void set_coefficient_weights(const Hit& hit, const SnapshotObject& object, std::span<CoefficientWeight> weights)
{
    std::fill(weights.begin(), weights.end(), CoefficientWeight());
    const IsosurfaceSnapshot* const surface = hit ? surface_of(hit, object) : nullptr;
    if (surface == nullptr)
        return;
    const Volume& volume = surface->volume();
    const glm::dmat4 to_index = volume.world_to_index() * glm::inverse(object.transform);
    set_coefficient_weights(volume, volume.cell_at(hit.primitive_id), transform_point(to_index, hit.position), to_index,
                            weights);
}

} // namespace isospline
