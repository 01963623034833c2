// Squared distances from planes.
#pragma once

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include <algorithm>

namespace isospline {

/// The sum of squared distances from planes, weighted by area, and the sum of the weights.
struct Quadric {
    glm::dmat3 a{0.0};
    glm::dvec3 b{0.0};
    double c = 0.0, weight = 0.0;

    void add_plane(const glm::dvec3& normal, double offset, double area)
    {
        a += area * glm::outerProduct(normal, normal);
        b -= area * offset * normal;
        c += area * offset * offset;
        weight += area;
    }
    void add(const Quadric& other)
    {
        a += other.a;
        b += other.b;
        c += other.c;
        weight += other.weight;
    }
    double mean_square(const glm::dvec3& x) const
    {
        return weight > 0.0 ? std::max(glm::dot(x, a * x) + 2.0 * glm::dot(b, x) + c, 0.0) / weight : 0.0;
    }
};

} // namespace isospline
