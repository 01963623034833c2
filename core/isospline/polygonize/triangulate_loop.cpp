#include "isospline/polygonize/triangulate_loop.h"

#include <glm/geometric.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>

namespace isospline {

namespace {

constexpr std::size_t most_vertices = 18;
constexpr double forbidden = std::numeric_limits<double>::infinity();

/// Triangulations of the polygons that diagonals cut off, from small ones to the whole loop.
class Triangulation {
public:
    Triangulation(std::span<const CubeEdge> loop, std::span<const glm::dvec3> positions) : size_(loop.size())
    {
        for (std::size_t first = 0; first + 1 < size_; ++first)
            cost_[first][first + 1] = 0.0;
        for (std::size_t length = 2; length < size_; ++length)
            for (std::size_t first = 0; first + length < size_; ++first) {
                const std::size_t last = first + length;
                double least = forbidden;
                for (std::size_t middle = first + 1; middle < last; ++middle)
                    if (const double cost = cost_[first][middle] + cost_[middle][last]; cost < least) {
                        least = cost;
                        apex_[first][last] = static_cast<std::uint8_t>(middle);
                    }
                const bool is_diagonal = length + 1 < size_;
                if (is_diagonal && (faces_of(loop[first]) & faces_of(loop[last])) != 0)
                    least = forbidden;
                else if (is_diagonal) {
                    const glm::dvec3 difference = positions[last] - positions[first];
                    least += glm::dot(difference, difference);
                }
                cost_[first][last] = least;
            }
    }

    bool exists() const { return cost_[0][size_ - 1] < forbidden; }

    void append(LoopTriangles& triangles) const { append(triangles, 0, size_ - 1); }

private:
    void append(LoopTriangles& triangles, std::size_t first, std::size_t last) const
    {
        if (last - first < 2)
            return;
        const std::size_t apex = apex_[first][last];
        triangles.push_back(
            {static_cast<std::uint8_t>(first), static_cast<std::uint8_t>(apex), static_cast<std::uint8_t>(last)});
        append(triangles, first, apex);
        append(triangles, apex, last);
    }

    std::size_t size_;
    double cost_[most_vertices][most_vertices];
    std::uint8_t apex_[most_vertices][most_vertices] = {};
};

} // namespace

bool triangulate_loop(std::span<const CubeEdge> loop, std::span<const glm::dvec3> positions, LoopTriangles& triangles)
{
    triangles.clear();
    if (loop.size() == 3) {
        triangles.push_back({0, 1, 2});
        return true;
    }
    const Triangulation best(loop, positions);
    if (!best.exists())
        return false;
    best.append(triangles);
    return true;
}

} // namespace isospline
