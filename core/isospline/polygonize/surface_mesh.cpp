#include "isospline/polygonize/surface_mesh.h"

#include "isospline/math/affine.h"
#include "isospline/polygonize/covering.h"
#include "isospline/polygonize/editable_mesh.h"
#include "isospline/polygonize/face_crossing.h"
#include "isospline/polygonize/face_octree.h"
#include "isospline/polygonize/lattice_mesh.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/mesh_proof.h"
#include "isospline/polygonize/simplify.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/hit.h"
#include "isospline/trace/surface_hit.h"
#include "isospline/util/check.h"
#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace isospline {

namespace {

/// Locks the vertices near to parts of the surface that a simplified mesh left out.
void lock_near(const std::vector<Box>& boxes, const LabeledMesh& mesh, double margin, std::vector<std::uint8_t>& locked)
{
    Box bounds;
    for (const Box& box : boxes)
        bounds.extend(box);
    FaceOctree octree(bounds, boxes.size(), 0.25 * margin);
    for (std::size_t i = 0; i < boxes.size(); ++i)
        octree.insert(static_cast<std::uint32_t>(i), boxes[i]);
    for (std::size_t i = 0; i < locked.size(); ++i)
        if (!octree.visit({mesh.vertices[i] - margin, mesh.vertices[i] + margin}, [](std::uint32_t) { return false; }))
            locked[i] = 1;
}

/// A mesh with few faces, and what is proven of it. Locations are in lattice space.
struct SimplifiedMesh {
    LabeledMesh mesh;
    double distance;
    std::vector<Box> uncovered;
};

template <int Degree>
SimplifiedMesh simplified_mesh(const IsosurfaceSnapshot& surface, double tolerance, const Progress& progress)
{
    // The mesh of the lattice leaves a part of the tolerance for simplification, which leaves a part for points between
    // those where it measures.
    constexpr double part_of_lattice = 0.6, part_of_faces = 0.9, part_of_vertices = 0.8;
    constexpr int attempts = 4;
    const LatticeField<Degree> field(surface, 1);
    const LatticeMetric metric(surface.volume().lattice_to_world());
    const LabeledMesh fine = lattice_mesh<Degree>(surface, part_of_lattice * tolerance, part_of(progress, 0.0, 0.3));
    Simplicity simplicity{part_of_faces * tolerance, part_of_vertices * tolerance,
                          std::vector<std::uint8_t>(fine.vertices.size(), 0)};
    std::vector<Collapse> history;
    MeshProof<Degree> proof(field, tolerance);
    // Where the proof fails, vertices are locked, and simplification begins again.
    double margin = 0.5 * tolerance / metric.shortest_edge;
    for (int attempt = 1;; ++attempt) {
        LabeledMesh mesh = fine;
        const double left = 0.7 * std::pow(0.25, attempt - 1); // most of the work is in the first attempt
        const Progress of_attempt = part_of(progress, 1.0 - left, 1.0 - 0.25 * left);
        simplify(field, mesh, simplicity, history, part_of(of_attempt, 0.0, 0.7));
        proof.examine(mesh, part_of(of_attempt, 0.7, 1.0));
        const std::vector<Box> failed = proof.failed(mesh);
        if (failed.empty() || attempt == attempts) {
            drop_unused_vertices(mesh);
            return {std::move(mesh), proof.distance(), proof.uncovered()};
        }
        lock_near(failed, fine, margin, simplicity.locked);
        margin *= 4.0;
    }
}

/// Maps a mesh from lattice space to the world, and adds normals.
template <int Degree>
SurfaceMesh to_world(const IsosurfaceSnapshot& surface, LabeledMesh mesh, const Progress& progress)
{
    const LatticeField<Degree> field(surface, 1);
    const Volume& volume = surface.volume();
    SurfaceMesh result{
        std::move(mesh.vertices), {}, std::move(mesh.faces), std::numeric_limits<double>::quiet_NaN(), {}, 0};
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
    if (tolerance) {
        check_positive("tolerance", *tolerance);
        // Everything is within the diagonal of the volume's box. Larger tolerances mean the same, and could overflow.
        tolerance = std::min(*tolerance, glm::length(surface.volume().bounds().size()));
    }
    return dispatch_degree(surface.volume().degree(), [&](auto degree) {
        if (!tolerance) {
            LabeledMesh mesh = lattice_mesh<degree>(surface, {}, part_of(progress, 0.0, 0.9));
            return to_world<degree>(surface, std::move(mesh), part_of(progress, 0.9, 1.0));
        }
        SimplifiedMesh simplified = simplified_mesh<degree>(surface, *tolerance, part_of(progress, 0.0, 0.9));
        std::vector<LeftOut> left_out =
            join_boxes(simplified.uncovered, simplified.mesh, surface.volume().lattice_to_world());
        SurfaceMesh result = to_world<degree>(surface, std::move(simplified.mesh), part_of(progress, 0.9, 0.95));
        result.distance = simplified.distance;
        result.left_out = std::move(left_out);
        result.crossings = count_crossings(result.vertices, result.faces, part_of(progress, 0.95, 1.0));
        return result;
    });
}

} // namespace isospline
