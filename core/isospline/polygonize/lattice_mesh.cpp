#include "isospline/polygonize/lattice_mesh.h"

#include "isospline/polygonize/cells_in_question.h"
#include "isospline/polygonize/covering.h"
#include "isospline/polygonize/editable_mesh.h"
#include "isospline/polygonize/face_distance.h"
#include "isospline/polygonize/lattice_mesher.h"
#include "isospline/polygonize/nearness.h"
#include "isospline/polygonize/tetrahedron_mesher.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <unordered_set>
#include <utility>
#include <vector>

namespace isospline {

namespace {

/// Edges shorter than this fraction of a cell are collapsed. With a tolerance, simplification collapses those that are
/// left, and checks that no faces cross.
constexpr double shortest_edge = 1e-3, shortest_before_simplification = 1e-6;
/// Subdivisions of a cell in the lattice of all cubes; those that are too coarse are refined further.
constexpr int finest_lattice = 8;
/// If more than one cube in this number is too coarse, all are halved. To refine one alone costs more.
constexpr std::size_t most_coarse = 2;
/// The part of the tolerance within which the mesh has to be: it leaves a part for simplification.
constexpr double part_of_lattice = 0.8;
/// Faces whose samples are within this part of the tolerance need no proof.
constexpr double part_without_proof = 0.48;
constexpr int most_rounds = 12;

/// A box around a face whose interior is not empty.
Box box_around(const LabeledMesh& mesh, std::uint32_t face)
{
    const Box box = box_of(mesh.vertices, mesh.faces[face]);
    constexpr double margin = 1e-6; // the tetrahedra on both sides of a face between cubes
    return {box.lower - margin, box.upper + margin};
}

/// A part of the groups of cells shows whether a lattice is fine enough: every fourth group in small meshes, fewer in
/// larger ones.
std::size_t sample_groups_of(const LabeledMesh& mesh)
{
    constexpr std::size_t least = 4, most = 64, faces_per_group = 32768;
    return std::clamp(mesh.faces.size() / faces_per_group, least, most);
}
/// Selects the cells of every group at this distance, or all others.
CellFilter every_group(std::size_t count, bool others)
{
    return [count, others](const glm::ivec3& first) {
        BrickCells cells{};
        for (int child = 0; child < 8; ++child) {
            const glm::ivec3 at = child_position(child), group = first / 4 + at;
            const bool is_chosen = static_cast<std::size_t>(group.x + 3 * group.y + 9 * group.z) % count == 0;
            if (is_chosen != others)
                for (int z = 4 * at.z; z < 4 * at.z + 4; ++z)
                    cells[static_cast<std::size_t>(z)] |= std::uint64_t{0x0f0f0f0f} << (4 * at.x + 32 * at.y);
        }
        return cells;
    };
}

/// The number of cubes, with edges of 1 / steps, that boxes meet.
std::size_t count_cubes(const std::vector<Box>& boxes, double steps)
{
    std::unordered_set<CrossingKey> cubes;
    for (const Box& box : boxes) {
        const glm::ivec3 first(glm::floor(steps * box.lower));
        const glm::ivec3 last = glm::max(first, glm::ivec3(glm::ceil(steps * box.upper)) - 1);
        glm::ivec3 at;
        for (at.z = first.z; at.z <= last.z; ++at.z)
            for (at.y = first.y; at.y <= last.y; ++at.y)
                for (at.x = first.x; at.x <= last.x; ++at.x)
                    cubes.insert(crossing_key(glm::max(at, 0), 0));
    }
    return cubes.size();
}

/// The progress of the lattice with this subdivision: half of what the coarser ones left.
Progress rest_of(const Progress& progress, int subdivision)
{
    return part_of(progress, 1.0 - 1.0 / subdivision, 1.0 - 0.5 / subdivision);
}

/// The mesh of one lattice, whose cubes are refined again and again.
template <int Degree>
class RefinedLattice {
public:
    /// `filter` selects the cells whose cubes may be cut.
    RefinedLattice(const IsosurfaceSnapshot& surface, int subdivision, const CellFilter& filter,
                   const Progress& progress)
        : field_(surface, subdivision), special_(surface.planes(), subdivision), tetrahedra_(field_, special_)
    {
        tetrahedra_.add_cut_cubes(filter, progress);
    }

    /// The mesh in the cells that a filter selects.
    LabeledMesh mesh(const CellFilter& filter, const Progress& progress)
    {
        std::vector<MeshPart> parts = march_cubes(field_, special_, filter, part_of(progress, 0.0, 0.6));
        parts.push_back(tetrahedra_.march(filter, part_of(progress, 0.6, 0.8)));
        return join_parts(std::move(parts), part_of(progress, 0.8, 1.0));
    }

    /// Boxes of two kinds: with surface that is not proven to be near the mesh, and around faces that are not near the
    /// surface. Faces are measured at samples; those with a sample that is just near must also be proven to be within
    /// the tolerance.
    std::vector<Box> far_boxes(const LabeledMesh& mesh, const SurfaceParts& parts, double tolerance,
                               const CellFilter& filter, const Progress& progress) const
    {
        const LatticeMetric metric(field_.surface().volume().lattice_to_world());
        const double cube = 1.0 / field_.subdivision();
        const double reach = part_of_lattice * tolerance;
        const CoveringEdges edges{std::min(0.25 * reach / metric.shortest_edge, 0.125 * cube), 0.5 * cube};
        std::vector<Box> boxes =
            cover_surface(field_, parts, mesh, reach, edges, filter, part_of(progress, 0.0, 0.7)).uncovered;
        const Nearness<Degree> near(field_, metric, reach), very_near(field_, metric, part_without_proof * tolerance);
        std::vector<std::uint8_t> is_far(mesh.faces.size(), 0);
        parallel_for(
            mesh.faces.size(), 4096,
            [&](std::size_t begin, std::size_t end) {
                FaceDistance<Degree> distance(field_, parts, metric, false);
                for (std::size_t i = begin; i < end; ++i) {
                    const Corners corners = corners_of(mesh, i);
                    const FaceLabel label = mesh.labels[i];
                    if (!is_chosen(filter, glm::ivec3((corners[0] + corners[1] + corners[2]) / 3.0)))
                        continue;
                    const auto are_samples = [&](const Nearness<Degree>& nearness) {
                        return for_each_sample(corners, measured_spacing,
                                               [&](const glm::dvec3& at) { return nearness.is_near(at, label); });
                    };
                    is_far[i] = !are_samples(very_near) &&
                                (!are_samples(near) || distance.bound(corners, label, tolerance) > tolerance);
                }
            },
            part_of(progress, 0.7, 1.0));
        for (std::uint32_t face = 0; face < is_far.size(); ++face)
            if (is_far[face] != 0)
                boxes.push_back(box_around(mesh, face));
        return boxes;
    }

    void refine(const std::vector<Box>& boxes, double longest_edge, const Progress& progress)
    {
        tetrahedra_.refine(boxes, longest_edge, progress);
    }

private:
    const LatticeField<Degree> field_;
    SpecialCubes special_;
    TetrahedronMesher<Degree> tetrahedra_;
};

} // namespace

template <int Degree>
LabeledMesh lattice_mesh(const IsosurfaceSnapshot& surface, const Progress& progress)
{
    LabeledMesh mesh =
        RefinedLattice<Degree>(surface, 1, {}, part_of(progress, 0.0, 0.2)).mesh({}, part_of(progress, 0.2, 1.0));
    merge_close_vertices(mesh, shortest_edge);
    return mesh;
}

template <int Degree>
LabeledMesh lattice_mesh(const IsosurfaceSnapshot& surface, const SurfaceParts& parts, double tolerance,
                         const Progress& progress)
{
    LabeledMesh mesh;
    for (int subdivision = 1;; subdivision *= 2) {
        const Progress of_lattice = rest_of(progress, subdivision);
        RefinedLattice<Degree> lattice(surface, subdivision, {}, part_of(of_lattice, 0.0, 0.1));
        mesh = lattice.mesh({}, part_of(of_lattice, 0.1, 0.4));
        const std::size_t sample_groups = sample_groups_of(mesh);
        std::vector<Box> boxes =
            lattice.far_boxes(mesh, parts, tolerance, every_group(sample_groups, false), part_of(of_lattice, 0.4, 0.5));
        if (subdivision < finest_lattice &&
            sample_groups * most_coarse * count_cubes(boxes, subdivision) > mesh.faces.size() / 2)
            continue;
        const std::vector<Box> others =
            lattice.far_boxes(mesh, parts, tolerance, every_group(sample_groups, true), part_of(of_lattice, 0.5, 0.7));
        boxes.insert(boxes.end(), others.begin(), others.end());
        if (boxes.empty())
            break;
        // Only the neighborhood of what is refined changes.
        const LatticeMetric metric(surface.volume().lattice_to_world());
        const double reach = 1.0 + std::ceil(part_of_lattice * tolerance / metric.shortest_edge);
        double longest_edge = std::sqrt(3.0) / subdivision; // a diagonal of a cube
        for (int round = 1; round <= most_rounds && !boxes.empty(); ++round) {
            const auto begin = 0.7 + 0.2 * (round - 1) / most_rounds, end = 0.7 + 0.2 * round / most_rounds;
            const Progress of_round = part_of(of_lattice, begin, end);
            longest_edge *= 0.7;
            lattice.refine(boxes, longest_edge, of_round);
            const glm::ivec3 shape = surface.volume().cell_shape();
            const ChosenCells around(boxes, 1.0 + reach, shape), near(boxes, 1.0, shape);
            const LabeledMesh changed = lattice.mesh(around.filter(), part_of(of_round, 0.0, 0.5));
            boxes = lattice.far_boxes(changed, parts, tolerance, near.filter(), part_of(of_round, 0.5, 1.0));
        }
        mesh = lattice.mesh({}, part_of(of_lattice, 0.9, 1.0));
        break;
    }
    merge_close_vertices(mesh, shortest_before_simplification);
    return mesh;
}

template <int Degree>
LabeledMesh lattice_mesh_of_layers(const IsosurfaceSnapshot& surface, int first, int last, const Progress& progress)
{
    const CellFilter layers = [first, last](const glm::ivec3& cell) {
        return first <= cell.z && cell.z < last ? all_cells(glm::ivec3(brick_size)) : BrickCells{};
    };
    RefinedLattice<Degree> lattice(surface, 1, layers, part_of(progress, 0.0, 0.2));
    LabeledMesh mesh = lattice.mesh(layers, part_of(progress, 0.2, 1.0));
    merge_close_vertices(mesh, shortest_edge,
                         [first, last, end = surface.volume().cell_shape().z](const glm::dvec3& vertex) {
                             return (first > 0 && vertex.z <= first) || (last < end && vertex.z >= last);
                         });
    return mesh;
}

template LabeledMesh lattice_mesh<1>(const IsosurfaceSnapshot&, const Progress&);
template LabeledMesh lattice_mesh<1>(const IsosurfaceSnapshot&, const SurfaceParts&, double, const Progress&);
template LabeledMesh lattice_mesh<2>(const IsosurfaceSnapshot&, const Progress&);
template LabeledMesh lattice_mesh<2>(const IsosurfaceSnapshot&, const SurfaceParts&, double, const Progress&);
template LabeledMesh lattice_mesh<3>(const IsosurfaceSnapshot&, const Progress&);
template LabeledMesh lattice_mesh<3>(const IsosurfaceSnapshot&, const SurfaceParts&, double, const Progress&);
template LabeledMesh lattice_mesh_of_layers<1>(const IsosurfaceSnapshot&, int, int, const Progress&);
template LabeledMesh lattice_mesh_of_layers<2>(const IsosurfaceSnapshot&, int, int, const Progress&);
template LabeledMesh lattice_mesh_of_layers<3>(const IsosurfaceSnapshot&, int, int, const Progress&);

} // namespace isospline
