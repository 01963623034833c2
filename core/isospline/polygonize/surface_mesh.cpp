#include "isospline/polygonize/surface_mesh.h"

#include "isospline/math/affine.h"
#include "isospline/polygonize/coarse_cubes.h"
#include "isospline/polygonize/lattice_mesher.h"
#include "isospline/polygonize/merge_vertices.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/nearness.h"
#include "isospline/polygonize/simplify.h"
#include "isospline/polygonize/tetrahedron_mesher.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/hit.h"
#include "isospline/trace/surface_hit.h"
#include "isospline/util/check.h"
#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <tuple>
#include <utility>

namespace isospline {

namespace {

/// Edges shorter than this fraction of a cell are collapsed.
constexpr double shortest_edge = 1e-3;

/// The mesh of the lattice, refined where it is too coarse for the tolerance, if one is given.
template <int Degree>
LabeledMesh lattice_mesh(const IsosurfaceSnapshot& surface, std::optional<double> tolerance, const Progress& progress)
{
    // Choose a lattice so fine that few cubes have to be refined.
    constexpr int finest = 8;
    constexpr std::size_t most_coarse = 3; // one of this number of cubes
    int subdivision = 1;
    CoarseCubes coarse;
    while (tolerance) {
        coarse = coarse_cubes(LatticeField<Degree>(surface, subdivision), SpecialCubes(surface.planes(), subdivision),
                              *tolerance, part_of(progress, 0.0, 0.1));
        if (subdivision == finest || coarse.cubes.size() * most_coarse <= coarse.surface_count)
            break;
        subdivision *= 2;
    }
    const LatticeField<Degree> field(surface, subdivision);
    SpecialCubes special(surface.planes(), subdivision);
    TetrahedronMesher<Degree> tetrahedra(field, special);
    tetrahedra.add_cut_cubes(part_of(progress, 0.1, 0.2));
    if (tolerance)
        tetrahedra.refine(coarse.cubes, *tolerance, part_of(progress, 0.2, 0.3));
    std::vector<MeshPart> parts = march_cubes(field, special, part_of(progress, 0.3, 0.7));
    parts.push_back(tetrahedra.march(part_of(progress, 0.7, 0.8)));
    LabeledMesh mesh = join_parts(std::move(parts), part_of(progress, 0.8, 1.0));
    merge_close_vertices(mesh, shortest_edge);
    return mesh;
}

/// A mesh within the tolerance with few faces, and the distance that is measured.
template <int Degree>
std::pair<LabeledMesh, double> simplified_mesh(const IsosurfaceSnapshot& surface, double tolerance,
                                               const Progress& progress)
{
    // The mesh of the lattice leaves a part of the tolerance for simplification, which leaves a part for points between
    // samples. Collapses keep the measured distance within the tolerance. If a face of the lattice's mesh exceeds it,
    // the lattice is made finer.
    constexpr double part_of_simplification = 0.9, less = 0.5;
    constexpr int attempts = 4;
    const LatticeField<Degree> field(surface, 1);
    double part_of_lattice = 0.7;
    for (int attempt = 1;; ++attempt, part_of_lattice *= less) {
        LabeledMesh mesh = lattice_mesh<Degree>(surface, part_of_lattice * tolerance, part_of(progress, 0.0, 0.3));
        const double of_vertices =
            simplify(field, mesh, part_of_simplification * tolerance, part_of(progress, 0.3, 0.9));
        const double of_faces = distance_from_surface(field, mesh, tolerance, part_of(progress, 0.9, 1.0));
        const double distance = std::max(of_vertices, of_faces);
        if (distance <= tolerance || attempt == attempts)
            return {std::move(mesh), distance};
    }
}

/// Maps a mesh from lattice space to the world, and adds normals.
template <int Degree>
SurfaceMesh to_world(const IsosurfaceSnapshot& surface, LabeledMesh mesh, const Progress& progress)
{
    const LatticeField<Degree> field(surface, 1);
    const Volume& volume = surface.volume();
    SurfaceMesh result{std::move(mesh.vertices), {}, std::move(mesh.faces), 0.0};
    result.normals.resize(result.vertices.size());

    // Vertices on caps only have a cap's normal; if gradients vanish, normals are those of faces.
    std::vector<FaceLabel> label(result.vertices.size(), ~FaceLabel{0});
    for (std::size_t face = 0; face < result.faces.size(); ++face)
        for (int corner = 0; corner < 3; ++corner)
            label[result.faces[face][corner]] = std::min(label[result.faces[face][corner]], mesh.labels[face]);
    parallel_for(
        result.vertices.size(), 4096,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                glm::dvec3& vertex = result.vertices[i];
                if (label[i] == on_isosurface) {
                    Hit hit;
                    set_surface_normal(hit, field.gradient(vertex), surface.options().inside,
                                       volume.world_to_lattice());
                    result.normals[i] = hit.normal;
                } else {
                    result.normals[i] = -glm::normalize(
                        transform_gradient(volume.world_to_lattice(), surface.planes().all()[label[i] - 1].normal));
                }
                vertex = transform_point(volume.lattice_to_world(), vertex);
            }
        },
        progress);

    const bool is_mirrored = glm::determinant(glm::dmat3(volume.lattice_to_world())) < 0.0;
    if (is_mirrored)
        for (glm::uvec3& face : result.faces)
            std::swap(face.y, face.z);
    return result;
}

} // namespace

SurfaceMesh to_mesh(const IsosurfaceSnapshot& surface, std::optional<double> tolerance, const Progress& progress)
{
    if (tolerance)
        check_positive("tolerance", *tolerance);
    return dispatch_degree(surface.volume().degree(), [&](auto degree) {
        LabeledMesh mesh;
        double distance = std::numeric_limits<double>::quiet_NaN();
        if (tolerance)
            std::tie(mesh, distance) = simplified_mesh<degree>(surface, *tolerance, part_of(progress, 0.0, 0.9));
        else
            mesh = lattice_mesh<degree>(surface, tolerance, part_of(progress, 0.0, 0.9));
        SurfaceMesh result = to_world<degree>(surface, std::move(mesh), part_of(progress, 0.9, 1.0));
        result.distance = distance;
        return result;
    });
}

} // namespace isospline
