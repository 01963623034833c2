// Random rays, many of them on shared faces, edges and corners of cells, for tests.
#pragma once

#include "isospline/math/ray.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <random>

namespace isospline {

/// Rays of every kind in lattice space: from far and near, from inside, along axes and planes, and through corners and
/// along edges of cells.
inline Ray random_lattice_ray(std::mt19937& random, const glm::dvec3& shape)
{
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::uniform_int_distribution<int> axis(0, 2), kind(0, 6);
    // In braces, numbers are drawn in the order of the text with every compiler.
    const auto point = [&] { return shape * glm::dvec3{unit(random), unit(random), unit(random)}; };
    const auto corner = [&] { return glm::floor(point() + 0.5); };
    glm::dvec3 target = point(), origin = target + 60.0 * glm::normalize(point() - 0.5 * shape);
    glm::dvec3 along(0.0);
    along[axis(random)] = unit(random) < 0.5 ? 1.0 : -1.0;
    switch (kind(random)) {
    case 0:
        break;
    case 1:
        origin = point();
        break;
    case 2:
        origin = target - 70.0 * along;
        break; // along an axis
    case 3:
        target = corner(), origin = target - 70.0 * along;
        break; // along an edge
    case 4:
        target = corner(), origin = 2.0 * (corner() - target);
        origin += corner();
        break; // through corners
    case 5:
        origin[axis(random)] = target[axis(random)];
        break;
    case 6:
        origin = corner(), target = point();
        break; // begins on a corner
    }
    if (origin == target)
        origin.x -= 50.0;
    return {origin, 0.37 * (target - origin)};
}

} // namespace isospline
