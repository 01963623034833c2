// Whether triangles are near a surface, measured at closely spaced points. This is no proof; see FaceDistance.
#pragma once

#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/surface_parts.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace isospline {

/// The largest spacing of the points of a triangle at which its distance is measured, in cells.
inline constexpr double measured_spacing = 0.25;
/// The largest distance that Newton's method may go from such a point, in cells.
inline constexpr double search_reach = 4.0;

/// Calls `visit` with points of a triangle until it returns false. Returns whether it never did. The points are in rows
/// parallel to the longest edge, without the corners. Rows, and the points in a row, are at most `spacing` apart.
template <typename Visit>
bool for_each_sample(const Corners& corners, double spacing, const Visit& visit)
{
    const auto steps = [spacing](double length) {
        return std::clamp(static_cast<int>(std::ceil(length / spacing)), 1, 1024);
    };
    std::size_t longest = 0;
    std::array<double, 3> length;
    for (std::size_t i = 0; i < 3; ++i) {
        length[i] = glm::distance(corners[i], corners[(i + 1) % 3]);
        if (length[i] > length[longest])
            longest = i;
    }
    const glm::dvec3 begin = corners[longest], end = corners[(longest + 1) % 3], apex = corners[(longest + 2) % 3];
    if (!visit((begin + end + apex) / 3.0))
        return false;
    const double height =
        length[longest] > 0.0 ? glm::length(glm::cross(end - begin, apex - begin)) / length[longest] : 0.0;
    const int row_count = steps(height);
    for (int row = 0; row < row_count; ++row) {
        const double up = static_cast<double>(row) / row_count;
        const glm::dvec3 first = begin + up * (apex - begin), last = end + up * (apex - end);
        const int count = steps((1.0 - up) * length[longest]);
        const int corner_count = row == 0 ? 1 : 0;
        for (int i = corner_count; i <= count - corner_count; ++i)
            if (!visit(first + static_cast<double>(i) / count * (last - first)))
                return false;
    }
    return true;
}

/// Whether points are near a surface or its caps.
template <int Degree>
class Nearness {
public:
    /// `reach` is the largest distance that counts as near, in world units. If parts are given, all points in near
    /// ones are near, too.
    Nearness(const LatticeField<Degree>& field, const LatticeMetric& metric, double reach,
             const SurfaceParts* parts = nullptr)
        : field_(field), metric_(metric), reach_(reach), parts_(parts), shape_(field.surface().volume().cell_shape())
    {
    }

    /// Whether |f - level| divided by the slope is within the reach. This is a cheap estimate.
    bool is_likely(const glm::dvec3& at, FaceLabel label) const
    {
        if (is_in_near_part(at, label))
            return true;
        const Step step = step_to_surface(at, label);
        return step.is_in_solid || step.value * step.value <= reach_ * reach_ * step.slope_square;
    }

    /// Whether a point of the surface, or of the cap of a face with this label, is found within the reach.
    bool is_near(const glm::dvec3& at, FaceLabel label) const
    {
        if (is_in_near_part(at, label))
            return true;
        const Step step = step_to_surface(at, label);
        if (step.is_in_solid)
            return true;
        if (!(step.slope_square > 0.0))
            return false;
        // If the point at the reach is on the other side, the surface is between both.
        const double part = -std::copysign(reach_, step.value) / std::sqrt(step.slope_square);
        const glm::dvec3 beyond = at + part * (metric_.to_lattice * step.gradient_world);
        if (beyond == glm::clamp(beyond, glm::dvec3(0.0), shape_) && (field_.value(beyond) < 0.0) != (step.value < 0.0))
            return true;
        const auto foot = label == on_isosurface ? field_.project(at, search_reach, metric_) : std::nullopt;
        return foot && metric_.length(*foot - at) <= reach_;
    }

private:
    struct Step {
        double value;
        glm::dvec3 gradient_world;
        double slope_square;
        bool is_in_solid; ///< on a cap
    };

    bool is_in_near_part(const glm::dvec3& at, FaceLabel label) const
    {
        return parts_ != nullptr && label == on_isosurface && parts_->is_near(at);
    }

    Step step_to_surface(const glm::dvec3& at, FaceLabel label) const
    {
        const PointInCell point(field_.surface(), at);
        const auto [value, slope] = scalar::value_and_gradient_in_cell<Degree>(point.cell, point.local);
        glm::dvec3 gradient = glm::dvec3(slope[0], slope[1], slope[2]) * metric_.to_lattice;
        if (label == on_isosurface)
            return {value, gradient, glm::dot(gradient, gradient), false};
        // Along the plane of a cap.
        const glm::dvec3 normal =
            glm::normalize(field_.surface().planes().all()[label - 1].normal * metric_.to_lattice);
        gradient -= glm::dot(gradient, normal) * normal;
        return {value, gradient, glm::dot(gradient, gradient), field_.is_solid(value)};
    }

    const LatticeField<Degree>& field_;
    const LatticeMetric& metric_;
    double reach_;
    const SurfaceParts* parts_;
    glm::dvec3 shape_;
};

} // namespace isospline
