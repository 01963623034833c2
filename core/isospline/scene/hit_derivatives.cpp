#include "isospline/scene/hit_derivatives.h"

#include "isospline/math/affine.h"
#include "isospline/math/grid.h"
#include "isospline/spline/basis.h"
#include "isospline/spline/line_filter.h"
#include "isospline/spline/sample.h"

#include <glm/common.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
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
    if (surface == nullptr)
        return 0;
    const auto along_axis = static_cast<std::size_t>((*surface)->volume().degree() + 1);
    return along_axis * along_axis * along_axis;
}

void set_coefficient_weights(const Hit& hit, const SnapshotObject& object, std::span<CoefficientWeight> weights)
{
    std::fill(weights.begin(), weights.end(), CoefficientWeight());
    const IsosurfaceSnapshot* const surface = hit ? surface_of(hit, object) : nullptr;
    if (surface == nullptr)
        return;
    const Volume& volume = surface->volume();
    const int degree = volume.degree();
    const glm::dmat4 to_index = volume.world_to_index() * glm::inverse(object.transform);
    const glm::dvec3 index = transform_point(to_index, hit.position);
    const glm::ivec3 first = volume.cell_at(hit.primitive_id) - degree / 2;
    std::array<std::array<int, 4>, 3> at;
    std::array<std::array<BasisValue, 4>, 3> basis;
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i <= degree; ++i) {
            const auto a = static_cast<std::size_t>(axis), k = static_cast<std::size_t>(i);
            at[a][k] = detail::inside_index(first[axis] + i, volume.shape()[axis], volume.boundary());
            basis[a][k] = bspline(degree, index[axis] - (first[axis] + i));
        }
    std::size_t next = 0;
    const auto count = static_cast<std::size_t>(degree) + 1;
    for (std::size_t k = 0; k < count; ++k)
        for (std::size_t j = 0; j < count; ++j)
            for (std::size_t i = 0; i < count; ++i, ++next) {
                const BasisValue &x = basis[0][i], &y = basis[1][j], &z = basis[2][k];
                const glm::dvec3 gradient(x.derivative * y.value * z.value, x.value * y.derivative * z.value,
                                          x.value * y.value * z.derivative);
                weights[next] = {static_cast<std::int64_t>(place_in(volume.shape(), {at[0][i], at[1][j], at[2][k]})),
                                 x.value * y.value * z.value, transform_gradient(to_index, gradient)};
            }
}

} // namespace isospline
