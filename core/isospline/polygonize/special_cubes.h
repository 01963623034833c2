// The cubes of a lattice that are split into tetrahedra.
#pragma once

#include "isospline/brick/cutout.h"
#include "isospline/polygonize/lattice_field.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <unordered_set>
#include <vector>

namespace isospline {

/// Points this close to a plane count as on it, in lattice units.
inline constexpr double on_plane_margin = 1e-9;

enum class CubeKind {
    plain,   ///< has one or more loops of vertices
    special, ///< is split into tetrahedra
    outside  ///< of the clip
};

/// Special cubes are those that a plane of the clip cuts, and those that are refined.
class SpecialCubes {
public:
    /// For a clip in lattice space. The half-spaces, whose normals have length one, must outlive it.
    SpecialCubes(const std::vector<HalfSpace>& half_spaces, int subdivision)
        : half_spaces_(half_spaces), edge_(1.0 / subdivision)
    {
    }

    const std::vector<HalfSpace>& half_spaces() const { return half_spaces_; }

    /// Marks a cube as refined; false if it already was.
    bool refine(const glm::ivec3& cube)
    {
        if (!refined_.insert(crossing_key(cube, 0)).second)
            return false;
        for (int corner = 0; corner < 8; ++corner)
            near_refined_.insert(group_key(cube - 1 + 2 * glm::ivec3(corner & 1, corner >> 1 & 1, corner >> 2)));
        return true;
    }

    /// The kind of the cube whose lower corner is a node.
    CubeKind kind(const glm::ivec3& cube) const
    {
        const CubeKind by_clip = kind_by_clip(cube, glm::ivec3(1));
        return by_clip == CubeKind::plain && refined_.count(crossing_key(cube, 0)) != 0 ? CubeKind::special : by_clip;
    }

    /// Whether all cubes in and next to a box of at most 8 x 8 x 8 that begins at a multiple of 8 are plain.
    bool all_plain_about(const glm::ivec3& first, const glm::ivec3& size) const
    {
        return kind_by_clip(first - 1, size + 2) == CubeKind::plain && near_refined_.count(group_key(first)) == 0;
    }

    /// The kind of the cubes in a box: special if one of them may be.
    CubeKind kind_by_clip(const glm::ivec3& first, const glm::ivec3& size) const
    {
        CubeKind kind = CubeKind::plain;
        for (const HalfSpace& half_space : half_spaces_) {
            const glm::dvec3 center = edge_ * (glm::dvec3(first) + 0.5 * glm::dvec3(size));
            const double distance = glm::dot(half_space.normal, center) - half_space.offset;
            const double reach = 0.5 * edge_ * glm::dot(glm::abs(half_space.normal), glm::dvec3(size));
            if (distance + reach < -0.5 * on_plane_margin)
                return CubeKind::outside;
            if (distance - reach <= 2.0 * on_plane_margin)
                kind = CubeKind::special;
        }
        return kind;
    }

private:
    /// The kinds of 8 x 8 x 8 cubes.
    static CrossingKey group_key(const glm::ivec3& cube) { return crossing_key(glm::max(cube, 0) / 8, 0); }

    const std::vector<HalfSpace>& half_spaces_;
    double edge_;
    std::unordered_set<CrossingKey> refined_, near_refined_;
};

} // namespace isospline
