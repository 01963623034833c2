// Where a volume is in the space of rays, with proven bounds: docs/method.md, "Certified rays".
#pragma once

#include "isospline/math/enclosure.h"

#include <glm/mat4x4.hpp>

#include <array>

namespace isospline {

class IsosurfaceSnapshot;

namespace certified {

inline Enclosure dot(const std::array<Enclosure, 3>& a, const std::array<Enclosure, 3>& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// The lattice of a surface's volume in the space of the rays, and bounds that all rays have in common.
struct Placement {
    /// `transform` maps the surface's world space to that of the rays.
    Placement(const IsosurfaceSnapshot& surface, const glm::dmat4& transform);

    std::array<std::array<Enclosure, 3>, 3> to_lattice; ///< rows of the linear part of the map to lattice space
    std::array<Enclosure, 3> origin;                    ///< of index space, in the space of the rays
    std::array<std::array<double, 3>, 3> product_error; ///< of an entry with a number of size 1, in a sum of products
    std::array<double, 3> origin_error;                 ///< of lattice coordinates, that comes from the origin's
    double slope;                                       ///< no partial derivative of f in lattice space is larger
    double threshold_error;
    double coefficient_error;
    double longest_edge; ///< of a cell in the space of the rays, bounded by the sum over its coordinates
    double along_error;  ///< of the product of to_lattice and a unit vector, summed over the axes
};

} // namespace certified
} // namespace isospline
