// The cubes of a lattice that are split into tetrahedra.
#pragma once

#include "isospline/brick/solid_planes.h"
#include "isospline/polygonize/lattice_field.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <unordered_set>
#include <vector>

namespace isospline {

enum class CubeKind {
    plain,   ///< has one or more loops of vertices
    special, ///< is split into tetrahedra
    outside  ///< of the solid's planes
};

/// Special cubes are those that a plane cuts or touches, and those that are refined.
class SpecialCubes {
public:
    /// The planes must outlive it.
    SpecialCubes(const SolidPlanes& planes, int subdivision) : planes_(planes), edge_(1.0 / subdivision) {}

    const SolidPlanes& planes() const { return planes_; }

    /// Marks a cube as refined.
    void refine(const glm::ivec3& cube)
    {
        refined_.insert(crossing_key(cube, 0));
        for (int corner = 0; corner < 8; ++corner)
            near_refined_.insert(group_key(cube - 1 + 2 * glm::ivec3(corner & 1, corner >> 1 & 1, corner >> 2)));
    }

    /// The kind of the cube whose lower corner is a node.
    CubeKind kind(const glm::ivec3& cube) const
    {
        const CubeKind by_planes = kind_by_planes(cube, glm::ivec3(1));
        return by_planes == CubeKind::plain && refined_.count(crossing_key(cube, 0)) != 0 ? CubeKind::special
                                                                                          : by_planes;
    }

    /// Whether all cubes in and next to a box of at most 8 x 8 x 8 that begins at a multiple of 8 are plain.
    bool all_plain_about(const glm::ivec3& first, const glm::ivec3& size) const
    {
        return kind_by_planes(first - 1, size + 2) == CubeKind::plain && near_refined_.count(group_key(first)) == 0;
    }

    /// The kind of the cubes in a box: special if one of them may be.
    CubeKind kind_by_planes(const glm::ivec3& first, const glm::ivec3& size) const
    {
        const Box box{edge_ * glm::dvec3(first), edge_ * glm::dvec3(first + size)};
        CubeKind kind = CubeKind::plain;
        for (const HalfSpace& half_space : planes_.all()) {
            if (is_outside(box, half_space))
                return CubeKind::outside;
            if (!is_inside(box, half_space))
                kind = CubeKind::special;
        }
        return kind;
    }

private:
    /// The kinds of 8 x 8 x 8 cubes.
    static CrossingKey group_key(const glm::ivec3& cube) { return crossing_key(glm::max(cube, 0) / 8, 0); }

    const SolidPlanes& planes_;
    double edge_;
    std::unordered_set<CrossingKey> refined_, near_refined_;
};

} // namespace isospline
