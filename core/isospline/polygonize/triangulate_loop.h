// From a loop of vertices on the faces of a cube to triangles.
#pragma once

#include "isospline/polygonize/cube_loops.h"

#include <glm/vec3.hpp>

#include <array>
#include <span>
#include <vector>

namespace isospline {

/// Triangles of positions in a loop.
using LoopTriangles = std::vector<std::array<std::uint8_t, 3>>;

/// Cuts a loop into triangles by the diagonals whose squared lengths have the least sum. None joins two edges of one
/// face of the cube: the cube behind that face might have the same diagonal, and an edge of the mesh would have four
/// faces. False where that leaves no way; the loop then needs a vertex in its middle.
bool triangulate_loop(std::span<const CubeEdge> loop, std::span<const glm::dvec3> positions, LoopTriangles& triangles);

} // namespace isospline
