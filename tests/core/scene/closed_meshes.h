// Closed meshes with their corners in counter-clockwise order as seen from outside, for tests of crossings.
#pragma once

#include "isospline/scene/mesh.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

namespace isospline::test {

struct ClosedMesh {
    /// Cuts each face into four, in the middles of its edges.
    ClosedMesh subdivided() const
    {
        ClosedMesh fine{vertices, {}};
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [item, is_new] =
                middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(fine.vertices.size()));
            if (is_new)
                fine.vertices.push_back(0.5 * (vertices[a] + vertices[b]));
            return item->second;
        };
        for (const glm::uvec3& face : faces) {
            const std::uint32_t ab = middle(face.x, face.y), bc = middle(face.y, face.z), ca = middle(face.z, face.x);
            fine.faces.insert(fine.faces.end(), {{face.x, ab, ca}, {face.y, bc, ab}, {face.z, ca, bc}, {ab, bc, ca}});
        }
        return fine;
    }

    std::vector<glm::dvec3> vertices;
    std::vector<glm::uvec3> faces;
};

inline ClosedMesh box(const glm::dvec3& half_size)
{
    ClosedMesh mesh;
    for (int corner = 0; corner < 8; ++corner)
        mesh.vertices.push_back(half_size *
                                glm::dvec3((corner & 1) ? 1 : -1, (corner & 2) ? 1 : -1, (corner & 4) ? 1 : -1));
    mesh.faces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                  {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}

inline ClosedMesh icosphere(int subdivisions)
{
    const double g = 0.5 * (1.0 + std::sqrt(5.0));
    ClosedMesh mesh{{{-1, g, 0},
                     {1, g, 0},
                     {-1, -g, 0},
                     {1, -g, 0},
                     {0, -1, g},
                     {0, 1, g},
                     {0, -1, -g},
                     {0, 1, -g},
                     {g, 0, -1},
                     {g, 0, 1},
                     {-g, 0, -1},
                     {-g, 0, 1}},
                    {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                     {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                     {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
    for (int i = 0; i < subdivisions; ++i)
        mesh = mesh.subdivided();
    for (glm::dvec3& vertex : mesh.vertices)
        vertex = glm::normalize(vertex);
    return mesh;
}

/// A tube of radius `tube` around a curve that winds `turns` times about the z axis; more than once, it is tangled.
inline ClosedMesh tube(int turns, double radius, int around, int along)
{
    ClosedMesh mesh;
    const double pi = std::numbers::pi;
    for (int i = 0; i < along; ++i) {
        const double u = 2.0 * pi * turns * i / along, wave = turns > 1 ? 0.3 * std::cos(u / turns) : 0.0;
        for (int j = 0; j < around; ++j) {
            const double v = 2.0 * pi * j / around, ring = 0.7 + wave + radius * std::cos(v);
            mesh.vertices.push_back({ring * std::cos(u), ring * std::sin(u), radius * std::sin(v) + wave * wave});
            const auto at = [&](int row, int column) {
                return static_cast<std::uint32_t>(row % along * around + column % around);
            };
            mesh.faces.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.faces.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    }
    return mesh;
}

/// Five meshes; the last one goes through itself, and crossings of the fourth are as close as rounding allows.
inline std::array<std::pair<const char*, ClosedMesh>, 5> closed_meshes()
{
    return {{{"box", box({1.0, 0.7, 0.4})},
             {"subdivided box", box(glm::dvec3(0.9)).subdivided().subdivided()},
             {"icosphere", icosphere(3)},
             {"thin box", box({1.0, 1.0, 1e-15}).subdivided().subdivided()},
             {"tangled tube", tube(3, 0.3, 12, 60)}}};
}

} // namespace isospline::test
