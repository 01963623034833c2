// What is cut away from an isosurface: whole cells by a mask, straight parts by half-spaces.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/math/grid.h"
#include "isospline/math/half_space.h"
#include "isospline/util/parallel.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

class Volume;

/// One byte a sample, x fastest; 0 if the sample is cut away. For even degrees, a cell is cut away if the sample at its
/// centre is. For odd degrees, it is cut away if a sample at any of its corners is, as with blanking in VTK.
using Mask = std::vector<std::uint8_t>;

/// The mask of the samples for which is_kept(sample) is true. It is called by several threads.
template <typename IsKept>
Mask make_mask(const glm::ivec3& shape, const IsKept& is_kept, const Progress& progress)
{
    Mask mask(static_cast<std::size_t>(place_count(shape)));
    parallel_for(
        static_cast<std::size_t>(shape.z), 1,
        [&](std::size_t begin, std::size_t end) {
            for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z)
                for (int y = 0; y < shape.y; ++y)
                    for (int x = 0; x < shape.x; ++x)
                        mask[static_cast<std::size_t>(place_in(shape, {x, y, z}))] = is_kept(glm::ivec3(x, y, z));
        },
        progress);
    return mask;
}

/// Whether a mask cuts a cell away.
bool is_cut_by_mask(const glm::ivec3& cell, const Mask& mask, const Volume& volume);

/// Removes the cells that a mask cuts away from a set.
void cut_by_mask(BrickCells& cells, const Brick& brick, const Mask& mask, const Volume& volume);

/// Whether a brick is wholly outside of a half-space, which is in lattice space; its normal has length one.
bool is_outside(const Brick& brick, const HalfSpace& half_space_lattice);

/// Removes the cells that are wholly outside of a half-space from a set. The half-space is in lattice space; its normal
/// has length one.
void cut_by_half_space(BrickCells& cells, const Brick& brick, const HalfSpace& half_space_lattice);

} // namespace isospline
