#include "isospline/trace/contains.h"

#include "isospline/math/affine.h"
#include "isospline/trace/cell_block.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace isospline {

bool contains(const Isosurface& surface, const glm::dvec3& position_world)
{
    const Volume& volume = surface.volume();
    const IsosurfaceOptions& options = surface.options();
    for (const HalfSpace& half_space : options.clip)
        if (!(glm::dot(half_space.normal, position_world) >= half_space.offset))
            return false;

    // The last cell along an axis has both of its faces.
    const glm::dvec3 lattice = transform_point(volume.world_to_lattice(), position_world);
    const glm::ivec3 last = volume.cell_shape() - 1;
    for (int axis = 0; axis < 3; ++axis)
        if (!(lattice[axis] >= 0.0 && lattice[axis] <= last[axis] + 1.0))
            return false;
    const glm::ivec3 at = glm::min(glm::ivec3(glm::floor(lattice)), last);
    const Mask& mask = options.shell.mask;
    if (!mask.empty() && is_cut_by_mask(at, mask, volume))
        return false;

    const Cell index{static_cast<std::uint16_t>(at.x), static_cast<std::uint16_t>(at.y),
                     static_cast<std::uint16_t>(at.z)};
    const CellBlock cell(volume, surface.threshold(), index);
    const glm::dvec3 local = lattice - cell.lower;
    const double value = volume.degree() == 1   ? value_in_cell<1>(cell, local)
                         : volume.degree() == 2 ? value_in_cell<2>(cell, local)
                                                : value_in_cell<3>(cell, local);
    return options.inside == Inside::above ? value > 0.0 : value < 0.0;
}

} // namespace isospline
