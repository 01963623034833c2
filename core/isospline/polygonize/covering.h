// Proof that a mesh is near to all of a surface and its caps.
#pragma once

#include "isospline/math/box.h"
#include "isospline/polygonize/cells_in_question.h"
#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/surface_parts.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <vector>

namespace isospline {

/// The edges of the boxes into which cover_surface() halves cells, in lattice units.
struct CoveringEdges {
    double least;    ///< of boxes that may be found uncovered
    double reported; ///< a box with at most this edge stands for an uncovered one in it
};

/// What is proven of a surface with its caps.
struct Covering {
    double distance = 0.0;      ///< from any point outside of the boxes to the mesh, at most; world units
    std::vector<Box> uncovered; ///< boxes in lattice space with all other points
};

/// Proves for parts of cells that all points of the surface and the caps in them are within a tolerance, in world
/// units, of a mesh.
///
/// Bernstein coefficients enclose the surface in a box by two parallel planes. The distance from a triangle is a convex
/// function, so its maximum over the polytope between the planes is at one of the polytope's corners. A box with
/// corners that are all within the tolerance of one triangle is covered, and so is one for which ParityProof succeeds
/// with all triangles near it. Other boxes are halved, until their edges are short, or the box contains surface beyond
/// the tolerance. First of all, cells are covered whose parts with surface are all near to parts with points of the
/// mesh.
template <int Degree>
Covering cover_surface(const LatticeField<Degree>& field, const SurfaceParts& parts, const LabeledMesh& mesh,
                       double tolerance, const CoveringEdges& edges, const CellFilter& filter,
                       const Progress& progress);

/// Half of the size of the box in lattice space around a ball in the world.
inline glm::dvec3 box_of_ball(const LatticeMetric& metric, double radius)
{
    const glm::dmat3 rows = glm::transpose(metric.to_lattice);
    return radius * glm::dvec3(glm::length(rows[0]), glm::length(rows[1]), glm::length(rows[2]));
}

/// The usual edge: 1/64 of a cell, or an eighth of the tolerance if that is less.
inline double least_edge_of(const LatticeMetric& metric, double tolerance)
{
    const glm::dvec3 reach = box_of_ball(metric, tolerance);
    return std::min(1.0 / 64.0, 0.125 * std::min({reach.x, reach.y, reach.z}));
}

} // namespace isospline
