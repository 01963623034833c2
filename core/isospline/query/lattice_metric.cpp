#include "isospline/query/lattice_metric.h"

#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

LatticeMetric::LatticeMetric(const glm::dmat4& lattice_to_world)
    : to_world(lattice_to_world), to_lattice(glm::inverse(to_world)), gram(glm::transpose(to_world) * to_world)
{
    // With the edges' lengths S and the cosines C between them, gram = S C S, so |L v|^2 is at least the smallest
    // eigenvalue of C times |S v|^2. That eigenvalue has two lower bounds: Gershgorin's, exact if C is the identity,
    // and det C / (3/2)^2, because the product of the other two eigenvalues is at most the square of their mean.
    const glm::dvec3 edges(glm::length(to_world[0]), glm::length(to_world[1]), glm::length(to_world[2]));
    const auto cosine = [&](int a, int b) { return gram[a][b] / (edges[a] * edges[b]); };
    const double xy = cosine(0, 1), yz = cosine(1, 2), zx = cosine(2, 0);
    const double row_sum =
        std::max({std::abs(xy) + std::abs(zx), std::abs(xy) + std::abs(yz), std::abs(yz) + std::abs(zx)});
    const double determinant = 1.0 + 2.0 * xy * yz * zx - xy * xy - yz * yz - zx * zx;
    const double least = std::max({1.0 - row_sum, determinant / 2.25, 0.0});
    stretch = std::sqrt(least) * edges;
    shortest_edge = std::min({edges.x, edges.y, edges.z});
}

} // namespace isospline
