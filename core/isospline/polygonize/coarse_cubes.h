// The cubes of a lattice that are too coarse for the surface.
#pragma once

#include "isospline/polygonize/special_cubes.h"

#include <cstddef>
#include <vector>

namespace isospline {

/// The cubes in which the surface may be farther than a tolerance from a plane.
struct CoarseCubes {
    std::vector<glm::ivec3> cubes;
    std::size_t surface_count = 0; ///< number of cubes that may contain surface
};

/// `tolerance` is in world units. Cubes that the clip cuts are left out.
template <int Degree>
CoarseCubes coarse_cubes(const LatticeField<Degree>& field, const SpecialCubes& special, double tolerance,
                         const Progress& progress);

} // namespace isospline
