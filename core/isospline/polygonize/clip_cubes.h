// Which cubes of a lattice the half-spaces of a clip cut.
#pragma once

#include "isospline/brick/cutout.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <vector>

namespace isospline {

/// Points this near a plane are on it, in lattice units.
inline constexpr double on_plane_margin = 1e-9;

enum class CubeKind { whole, cut, outside };

/// A clip in lattice space.
class ClipCubes {
public:
    /// The half-spaces, whose normals have length one, must outlive it.
    ClipCubes(const std::vector<HalfSpace>& half_spaces, int subdivision)
        : half_spaces_(half_spaces), edge_(1.0 / subdivision)
    {
    }

    const std::vector<HalfSpace>& half_spaces() const { return half_spaces_; }
    bool is_empty() const { return half_spaces_.empty(); }

    /// Of the cubes from `lower`, a node, to `lower` + `size`.
    CubeKind kind(const glm::ivec3& lower, const glm::ivec3& size) const
    {
        CubeKind kind = CubeKind::whole;
        for (const HalfSpace& half_space : half_spaces_) {
            const glm::dvec3 center = edge_ * (glm::dvec3(lower) + 0.5 * glm::dvec3(size));
            const double distance = glm::dot(half_space.normal, center) - half_space.offset;
            const double reach = 0.5 * edge_ * glm::dot(glm::abs(half_space.normal), glm::dvec3(size));
            if (distance + reach < -0.5 * on_plane_margin)
                return CubeKind::outside;
            if (distance - reach <= 2.0 * on_plane_margin)
                kind = CubeKind::cut;
        }
        return kind;
    }

private:
    const std::vector<HalfSpace>& half_spaces_;
    double edge_;
};

} // namespace isospline
