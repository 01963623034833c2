#include "isospline/polygonize/coarse_cubes.h"

#include "isospline/polygonize/flatness.h"
#include "isospline/util/parallel.h"

#include <bit>

namespace isospline {

template <int Degree>
CoarseCubes coarse_cubes(const LatticeField<Degree>& field, const SpecialCubes& special, double tolerance,
                         const Progress& progress)
{
    const IsosurfaceSnapshot& surface = field.surface();
    const LatticeMetric metric(surface.volume().lattice_to_world());
    const int subdivision = field.subdivision();
    std::vector<Brick> bricks;
    for (const Octet& octet : surface.bricks().octets())
        for (unsigned rest = octet.bricks; rest != 0; rest &= rest - 1u)
            bricks.push_back(surface.bricks().place(octet, std::countr_zero(rest)));

    std::vector<CoarseCubes> found(bricks.size());
    const auto look_at = [&](const glm::ivec3& cell, CoarseCubes& result) {
        const SurfaceBox<Degree> whole =
            surface_box<Degree>(VolumeCell(surface.volume(), surface.threshold(), cell), 0);
        glm::ivec3 part;
        for (part.z = 0; part.z < subdivision; ++part.z)
            for (part.y = 0; part.y < subdivision; ++part.y)
                for (part.x = 0; part.x < subdivision; ++part.x) {
                    const glm::ivec3 cube = cell * subdivision + part;
                    if (special.kind(cube) != CubeKind::plain)
                        continue;
                    const double thickness =
                        slab_thickness(part_of_cell(whole, glm::dvec3(part) / static_cast<double>(subdivision),
                                                    glm::dvec3(part + 1) / static_cast<double>(subdivision)),
                                       metric);
                    result.surface_count += thickness > 0.0;
                    if (thickness > tolerance)
                        result.cubes.push_back(cube);
                }
    };
    parallel_for(
        bricks.size(), 16,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                for_each_cell(surface.bricks().cells(bricks[i]),
                              [&](int x, int y, int z) { look_at(bricks[i].first + glm::ivec3(x, y, z), found[i]); });
        },
        progress);

    CoarseCubes all;
    for (const CoarseCubes& of_brick : found) {
        all.cubes.insert(all.cubes.end(), of_brick.cubes.begin(), of_brick.cubes.end());
        all.surface_count += of_brick.surface_count;
    }
    return all;
}

template CoarseCubes coarse_cubes(const LatticeField<1>&, const SpecialCubes&, double, const Progress&);
template CoarseCubes coarse_cubes(const LatticeField<2>&, const SpecialCubes&, double, const Progress&);
template CoarseCubes coarse_cubes(const LatticeField<3>&, const SpecialCubes&, double, const Progress&);

} // namespace isospline
