#include "isospline/polygonize/covering.h"

#include "isospline/polygonize/cell_covering.h"
#include "isospline/polygonize/cells_in_question.h"
#include "isospline/polygonize/near_mesh.h"
#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace isospline {

namespace {

/// Faces are nearby within this number of diagonals of a cell.
constexpr double cells_nearby = 2.0;
/// The boxes into which cells are halved that may be near to these.
constexpr CoveringEdges edges_nearby{0.5, 0.0};

/// The cells of a brick that are to be covered.
struct BrickToCover {
    Brick brick;
    std::vector<CellToCover> cells;
};

/// The blocks near to cells: within half of the size of a box.
MetBlocks blocks_near(const std::vector<BrickToCover>& bricks, const glm::ivec3& cell_shape, const glm::dvec3& reach)
{
    MetBlocks near(cell_shape);
    for (const BrickToCover& each : bricks)
        for (const CellToCover& cell : each.cells)
            near.add({glm::dvec3(cell.index) - reach, glm::dvec3(cell.index) + 1.0 + reach});
    return near;
}

} // namespace

template <int Degree>
Covering cover_surface(const LatticeField<Degree>& field, const SurfaceParts& parts, const LabeledMesh& mesh,
                       double tolerance, const CoveringEdges& edges, const CellFilter& filter, const Progress& progress)
{
    const IsosurfaceSnapshot& surface = field.surface();
    const LatticeMetric metric(surface.volume().lattice_to_world());
    const glm::ivec3 cell_shape = surface.volume().cell_shape();
    std::vector<BrickToCover> bricks;
    const auto drop_covered_bricks = [&bricks] {
        std::erase_if(bricks, [](const BrickToCover& each) { return each.cells.empty(); });
    };
    {
        const std::vector<BrickInQuestion> in_question = bricks_in_question(surface);
        bricks.resize(in_question.size());
        parallel_for(in_question.size(), 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                bricks[i].brick = in_question[i].brick;
                const BrickCells chosen = chosen_cells(filter, in_question[i].brick.first);
                if (chosen != BrickCells{})
                    for_each_cell_in_question(surface, in_question[i], chosen, [&](const glm::ivec3& cell, bool caps) {
                        bricks[i].cells.push_back({cell, true, caps});
                    });
            }
        });
        drop_covered_bricks();
    }
    const glm::dvec3 around = box_of_ball(metric, tolerance) + on_plane_margin;
    Covering all;
    if (const PartReach reach(metric, tolerance); parts.distance() > 0.0 && reach.distance() > 0.0 && !bricks.empty()) {
        const MetBlocks nearby = blocks_near(bricks, cell_shape, around);
        const CellParts near = parts_near_mesh(mesh, nearby, reach, cell_shape, part_of(progress, 0.0, 0.3));
        parallel_for(bricks.size(), 64, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                std::erase_if(bricks[i].cells, [&](CellToCover& cell) {
                    cell.with_surface = (parts.crossed().of_cell(cell.index) & ~near.of_cell(cell.index)) != 0;
                    return !cell.with_surface && !cell.with_caps;
                });
        });
        drop_covered_bricks();
        all.distance = reach.distance();
    }
    if (bricks.empty())
        return all;

    const MetBlocks nearby = blocks_near(bricks, cell_shape, around);
    const FaceOctree octree = octree_of(mesh, [&](const Box& box) { return nearby.are_met_by(box); });
    std::vector<glm::dvec3> world(mesh.vertices.size());
    std::transform(mesh.vertices.begin(), mesh.vertices.end(), world.begin(),
                   [&](const glm::dvec3& vertex) { return metric.to_world * vertex; });

    const ParityProof parity(mesh, world);
    // Most cells are near to faces beside them. Within a large tolerance, there are many others.
    const double diagonals = cells_nearby * glm::length(metric.to_world * glm::dvec3(1.0));
    std::vector<Covering> found(bricks.size()), found_nearby(bricks.size());
    parallel_for(
        bricks.size(), 4,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const auto cover = [&](double within, const CoveringEdges& until) {
                    CellCovering<Degree> covering(field, mesh, world, octree, parity, within, until);
                    if (!bricks[i].cells.empty())
                        covering.enter(bricks[i].brick);
                    std::erase_if(bricks[i].cells, [&](const CellToCover& cell) { return covering(cell); });
                    return covering.take();
                };
                if (diagonals < tolerance)
                    found_nearby[i].distance = cover(diagonals, edges_nearby).distance;
                found[i] = cover(tolerance, edges);
            }
        },
        part_of(progress, 0.3, 1.0));
    for (std::size_t i = 0; i < found.size(); ++i) {
        all.distance = std::max({all.distance, found[i].distance, found_nearby[i].distance});
        all.uncovered.insert(all.uncovered.end(), found[i].uncovered.begin(), found[i].uncovered.end());
    }
    return all;
}

template Covering cover_surface(const LatticeField<1>&, const SurfaceParts&, const LabeledMesh&, double,
                                const CoveringEdges&, const CellFilter&, const Progress&);
template Covering cover_surface(const LatticeField<2>&, const SurfaceParts&, const LabeledMesh&, double,
                                const CoveringEdges&, const CellFilter&, const Progress&);
template Covering cover_surface(const LatticeField<3>&, const SurfaceParts&, const LabeledMesh&, double,
                                const CoveringEdges&, const CellFilter&, const Progress&);

} // namespace isospline
