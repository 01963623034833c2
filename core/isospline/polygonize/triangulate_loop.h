// Triangulation of a loop of vertices on the faces of a cube.
#pragma once

#include "isospline/polygonize/cube_loops.h"

#include <glm/vec3.hpp>

#include <array>
#include <span>
#include <vector>

namespace isospline {

/// Triangles of positions in a loop.
using LoopTriangles = std::vector<std::array<std::uint8_t, 3>>;

/// Splits a loop into triangles by the diagonals with the smallest sum of squared lengths. No diagonal joins two edges
/// of one face of the cube: the cube behind that face might have the same diagonal, and an edge of the mesh would have
/// four faces. False if there is no such triangulation; the loop then needs a vertex in its middle.
bool triangulate_loop(std::span<const CubeEdge> loop, std::span<const glm::dvec3> positions, LoopTriangles& triangles);

} // namespace isospline
