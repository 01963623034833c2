// Affine maps between spaces, as 4x4 matrices whose last row is (0, 0, 0, 1).
#pragma once

#include "isospline/math/box.h"

#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

inline glm::dvec3 transform_point(const glm::dmat4& map, const glm::dvec3& point)
{
    return glm::dvec3(map * glm::dvec4(point, 1.0));
}

inline glm::dvec3 transform_vector(const glm::dmat4& map, const glm::dvec3& vector)
{
    return glm::dvec3(map * glm::dvec4(vector, 0.0));
}

/// A gradient (a covector) in the target space of a map, given the map's inverse: inverse transpose times gradient.
inline glm::dvec3 transform_gradient(const glm::dmat4& inverse, const glm::dvec3& gradient)
{
    return {glm::dot(glm::dvec3(inverse[0]), gradient), glm::dot(glm::dvec3(inverse[1]), gradient),
            glm::dot(glm::dvec3(inverse[2]), gradient)};
}

/// A bound on the rounding errors of the coordinates of a mapped point, given bounds on the point's.
inline double coordinate_error(const glm::dmat4& map, const glm::dvec3& point)
{
    double size = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        double terms = std::abs(map[3][axis]);
        for (int column = 0; column < 3; ++column)
            terms += std::abs(map[column][axis] * point[column]);
        size = std::max(size, terms);
    }
    return 8.0 * 0x1p-53 * size;
}

/// The box of the eight mapped corners of a box.
inline Box transform_box(const glm::dmat4& map, const Box& box)
{
    Box mapped;
    if (box.empty())
        return mapped;
    for (int corner = 0; corner < 8; ++corner)
        mapped.extend(
            transform_point(map, {(corner & 1) ? box.upper.x : box.lower.x, (corner & 2) ? box.upper.y : box.lower.y,
                                  (corner & 4) ? box.upper.z : box.lower.z}));
    return mapped;
}

} // namespace isospline
