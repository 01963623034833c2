#include "isospline/polygonize/near_mesh.h"

#include "isospline/util/parallel.h"

#include <algorithm>

namespace isospline {

CellParts parts_near_mesh(const LabeledMesh& mesh, const MetBlocks& blocks, const PartReach& reach,
                          const glm::ivec3& cell_shape, const Progress& progress)
{
    CellParts of_mesh(cell_shape), near(cell_shape);
    parallel_for(
        mesh.faces.size(), 4096,
        [&](std::size_t begin, std::size_t end) {
            RowsOfTriangle rows(of_mesh.shape());
            for (std::size_t i = begin; i < end; ++i)
                if (blocks.are_met_by(box_of(mesh.vertices, mesh.faces[i])))
                    rows(corners_of(mesh, i), [&](glm::ivec3 first, int last_x) {
                        for (; first.x <= last_x; first.x += parts_per_brick) {
                            const int count = std::min(last_x - first.x + 1, parts_per_brick);
                            of_mesh.add(first, (std::uint64_t{1} << count) - 1u);
                        }
                        return true;
                    });
        },
        part_of(progress, 0.0, 0.5));
    parallel_for(
        of_mesh.brick_count(), 64,
        [&](std::size_t begin, std::size_t end) {
            SpreadParts spread;
            for (std::size_t brick = begin; brick < end; ++brick) {
                bool has_any = false;
                of_mesh.for_each_row(brick, [&](int y, int z, std::uint32_t bits) {
                    spread.add(reach, y, z, bits);
                    has_any = true;
                });
                if (has_any)
                    spread.move_to(near, of_mesh.first_of(brick));
            }
        },
        part_of(progress, 0.5, 1.0));
    return near;
}

} // namespace isospline
