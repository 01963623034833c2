// World distances computed in lattice coordinates.
#pragma once

#include "isospline/math/box.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>

namespace isospline {

struct LatticeMetric {
    explicit LatticeMetric(const glm::dmat4& lattice_to_world);

    double length(const glm::dvec3& vector_lattice) const { return glm::length(to_world * vector_lattice); }

    /// A lower bound on the world distance of a point from a box, exact if the volume's axes are orthogonal.
    double distance_bound(const glm::dvec3& point_lattice, const Box& box) const
    {
        return glm::length(stretch * (point_lattice - glm::clamp(point_lattice, box.lower, box.upper)));
    }

    glm::dmat3 to_world;     ///< the linear part L of the map
    glm::dmat3 to_lattice;   ///< its inverse
    glm::dmat3 gram;         ///< transpose(L) L: squares of world lengths as a form of lattice vectors
    glm::dvec3 stretch{1.0}; ///< |L v| >= |stretch * v| for all v
    double shortest_edge;    ///< of a cell, world units
};

} // namespace isospline
