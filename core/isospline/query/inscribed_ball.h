// The largest ball in a solid near a point of its surface.
#pragma once

#include "isospline/math/box.h"
#include "isospline/query/closest_point.h"

#include <glm/vec3.hpp>

namespace isospline {

struct Ball {
    glm::dvec3 center;
    double radius;
};

/// A large ball in the solid whose distance from a point of the surface is at most `gap`: the local thickness of
/// T. Hildebrand and P. Ruegsegger, "A new method for the model-independent assessment of thickness in
/// three-dimensional images", Journal of Microscopy 185, 1997, which is insensitive to ripples lower than the gap. If
/// the gap is zero, the ball is the largest one that touches the surface at the point.
///
/// The first ball is centred on the inward normal. It shrinks until no point of the surface is deeper in it than the
/// gap: J. Ma, S. W. Bae, S. Choi, "3D medial axis point approximation using nearest neighbors and the normal field",
/// The Visual Computer 28, 2012. Then its centre moves to where a larger ball is, by linear programs with the points of
/// the surface that were nearest so far, until the radius grows by less than `precision`.
///
/// @param find Finds nearest points within `precision`.
/// @param at A point of the surface.
/// @param radius Of the first ball, whose centre and the way to it are in the solid.
/// @param bounds Where centres may be.
Ball inscribed_ball(ClosestPointFinder& find, const ClosestPoint& at, double radius, double gap, double precision,
                    const Box& bounds);

} // namespace isospline
