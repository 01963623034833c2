// Where a ray meets the surface in a cell.
#pragma once

#include <glm/vec3.hpp>

namespace isospline {

struct RootInCell {
    double t;
    glm::dvec3 gradient; ///< of f at the root, by lattice coordinates
};

/// One root in a list of all roots of a ray in a cell.
struct CrossingInCell {
    RootInCell root;
    bool rising; ///< f increases along the ray
};

} // namespace isospline
