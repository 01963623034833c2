#include "isospline/polygonize/surface_mesh.h"

#include "isospline/math/affine.h"
#include "isospline/polygonize/coarse_cubes.h"
#include "isospline/polygonize/lattice_mesher.h"
#include "isospline/polygonize/merge_vertices.h"
#include "isospline/polygonize/mesh_part.h"
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
#include <utility>

namespace isospline {

namespace {

/// Edges shorter than this part of a cell are collapsed.
constexpr double shortest_edge = 1e-3;

/// The mesh of the lattice, refined where it is too coarse for the tolerance, if there is one.
template <int Degree>
LabeledMesh lattice_mesh(const IsosurfaceSnapshot& surface, std::optional<double> tolerance, const Progress& progress)
{
    // So fine a lattice that few cubes have to be refined.
    constexpr int finest = 8;
    constexpr std::size_t most_coarse = 3; // of so many cubes, one
    int subdivision = 1;
    CoarseCubes coarse;
    while (tolerance) {
        coarse =
            coarse_cubes(LatticeField<Degree>(surface, subdivision), SpecialCubes(surface.clip_lattice(), subdivision),
                         *tolerance, part_of(progress, 0.0, 0.1));
        if (subdivision == finest || coarse.cubes.size() * most_coarse <= coarse.surface_count)
            break;
        subdivision *= 2;
    }
    const LatticeField<Degree> field(surface, subdivision);
    SpecialCubes special(surface.clip_lattice(), subdivision);
    TetrahedronMesher<Degree> tetrahedra(field, special);
    tetrahedra.add_clipped_cubes(part_of(progress, 0.1, 0.2));
    if (tolerance)
        tetrahedra.refine(coarse.cubes, *tolerance, part_of(progress, 0.2, 0.3));
    std::vector<MeshPart> parts = march_cubes(field, special, part_of(progress, 0.3, 0.7));
    parts.push_back(tetrahedra.march(part_of(progress, 0.7, 0.8)));
    LabeledMesh mesh = join_parts(std::move(parts), part_of(progress, 0.8, 1.0));
    merge_close_vertices(mesh, shortest_edge);
    return mesh;
}

/// Collapses edges until fewer faces would be too far from the surface; returns the distance that is measured.
template <int Degree>
double simplify_within(const IsosurfaceSnapshot& surface, LabeledMesh& mesh, double tolerance, const Progress& progress)
{
    // Samples that are closer to each other may show that the mesh has gone too far.
    constexpr double first_part = 0.9, less = 0.7;
    constexpr int attempts = 4;
    const LatticeField<Degree> field(surface, 1);
    const LabeledMesh whole = mesh;
    double part = first_part;
    for (int attempt = 0; attempt < attempts; ++attempt, part *= less) {
        mesh = whole;
        const double of_vertices = simplify(field, mesh, part * tolerance, part_of(progress, 0.0, 0.9));
        const double of_faces = distance_from_surface(field, mesh, part_of(progress, 0.9, 1.0));
        if (const double distance = std::max(of_vertices, of_faces); distance <= tolerance)
            return distance;
    }
    mesh = whole;
    return distance_from_surface(field, mesh, part_of(progress, 0.9, 1.0));
}

/// From lattice space to the world, with normals.
template <int Degree>
SurfaceMesh to_world(const IsosurfaceSnapshot& surface, LabeledMesh mesh, const Progress& progress)
{
    const LatticeField<Degree> field(surface, 1);
    const Volume& volume = surface.volume();
    SurfaceMesh result{std::move(mesh.vertices), {}, std::move(mesh.faces), 0.0};
    result.normals.resize(result.vertices.size());

    // Vertices of caps alone have a cap's normal; where gradients vanish, normals are those of faces.
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
                    result.normals[i] = -glm::normalize(surface.options().clip[label[i] - 1].normal);
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
        // The mesh of the lattice leaves some of the tolerance to simplification.
        constexpr double part_of_lattice = 0.7;
        const auto of_lattice = tolerance ? std::optional(part_of_lattice * *tolerance) : std::nullopt;
        LabeledMesh mesh = lattice_mesh<degree>(surface, of_lattice, part_of(progress, 0.0, tolerance ? 0.3 : 0.9));
        double distance = std::numeric_limits<double>::quiet_NaN();
        if (tolerance)
            distance = simplify_within<degree>(surface, mesh, *tolerance, part_of(progress, 0.3, 0.9));
        SurfaceMesh result = to_world<degree>(surface, std::move(mesh), part_of(progress, 0.9, 1.0));
        result.distance = distance;
        return result;
    });
}

} // namespace isospline
