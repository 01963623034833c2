#include "isospline/brick/cutout.h"

#include "isospline/spline/volume.h"

#include <glm/geometric.hpp>

namespace isospline {

bool is_cut_by_mask(const glm::ivec3& cell, const Mask& mask, const Volume& volume)
{
    const glm::vec<3, std::size_t> shape(volume.shape()), first(cell);
    const int samples = volume.degree() % 2 == 0 ? 1 : 2;
    for (int sample = 0; sample < samples * samples * samples; ++sample) {
        const std::size_t i = first.x + (sample & 1), j = first.y + (sample >> 1 & 1), k = first.z + (sample >> 2);
        if (mask[i + shape.x * (j + shape.y * k)] == 0)
            return true;
    }
    return false;
}

void cut_by_mask(BrickCells& cells, const Brick& brick, const Mask& mask, const Volume& volume)
{
    remove_cells(cells,
                 [&](int x, int y, int z) { return is_cut_by_mask(brick.first + glm::ivec3(x, y, z), mask, volume); });
}

bool is_outside(const Brick& brick, const HalfSpace& half_space_lattice)
{
    return is_outside(box_of(brick), half_space_lattice);
}

void cut_by_half_space(BrickCells& cells, const Brick& brick, const HalfSpace& half_space_lattice)
{
    if (DistanceRange(box_of(brick), half_space_lattice).least >= -plane_margin)
        return;
    const glm::dvec3& normal = half_space_lattice.normal;
    const glm::dvec3 first(brick.first);
    const double most = DistanceRange({first, first + 1.0}, half_space_lattice).most;
    remove_cells(cells,
                 [&](int x, int y, int z) { return most + glm::dot(normal, glm::dvec3(x, y, z)) < -plane_margin; });
}

} // namespace isospline
