#include "isospline/polygonize/surface_mesh.h"

#include "isospline/brick/brick.h"
#include "isospline/math/affine.h"
#include "isospline/polygonize/face_crossing.h"
#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/lattice_mesh.h"
#include "isospline/polygonize/left_out.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/simplified_mesh.h"
#include "isospline/polygonize/tolerance_search.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/hit.h"
#include "isospline/trace/surface_hit.h"
#include "isospline/util/check.h"
#include "isospline/util/error.h"
#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace isospline {

namespace {

/// The smallest tolerance for a number of faces, in voxels: parts of the surface between the nodes of the finest
/// lattice can be left out.
constexpr double finest_tolerance = 1.0 / 32.0;
/// The smallest tolerance that may be asked for, in voxels: edges of 1/32 are this far from an arc whose radius is two
/// voxels.
constexpr double least_tolerance = 0x1p-14;

/// The simplified mesh with the smallest tolerance that the search finds for at most this number of faces.
template <int Degree>
SimplifiedMesh mesh_of_faces(const IsosurfaceSnapshot& surface, std::size_t faces, const Progress& progress)
{
    constexpr double begin = 0.02; // of the meshes with a tolerance, in the progress
    const LatticeMetric metric(surface.volume().lattice_to_world());
    const double finest = finest_tolerance * metric.shortest_edge;
    double first = 0.5 * metric.shortest_edge, coarsest = glm::length(surface.volume().bounds().size());
    {
        // Most surfaces have a tenth of the faces of the plain mesh if the tolerance is a voxel.
        const LabeledMesh plain = lattice_mesh<Degree>(surface, part_of(progress, 0.0, begin));
        Box bounds;
        for (const glm::dvec3& vertex : plain.vertices)
            bounds.extend(metric.to_world * vertex);
        if (!plain.faces.empty())
            coarsest = std::min(coarsest, glm::length(bounds.size()));
        const double share = static_cast<double>(faces) / static_cast<double>(plain.faces.size());
        first = std::clamp(0.1 / share * metric.shortest_edge, first, std::max(first, 0.25 * coarsest));
    }
    coarsest = std::max(coarsest, first);

    ToleranceSearch search(faces, first, finest, coarsest);
    LabeledMesh fine;
    double tolerance_of_fine = 0.0, left = 1.0 - begin;
    std::optional<SimplifiedMesh> best, fewest;
    while (search.next()) {
        const double tolerance = *search.next();
        const Progress of_mesh = part_of(progress, 1.0 - left, 1.0 - 0.6 * left);
        left *= 0.6;
        const SurfaceParts parts(LatticeField<Degree>(surface, 1), tolerance, part_of(of_mesh, 0.0, 0.1));
        // The lattice for a slightly smaller tolerance serves as well.
        constexpr double most_too_fine = 4.0;
        if (!(tolerance_of_fine <= tolerance && tolerance <= most_too_fine * tolerance_of_fine)) {
            fine = lattice_mesh<Degree>(surface, parts, tolerance, part_of(of_mesh, 0.1, 0.5));
            tolerance_of_fine = tolerance;
        }
        SimplifiedMesh mesh = simplified_mesh<Degree>(surface, parts, fine, tolerance, part_of(of_mesh, 0.5, 1.0));
        if (mesh.mesh.faces.empty())
            return mesh;
        if (search.add(mesh.mesh.faces.size()))
            best = std::move(mesh);
        else if (!fewest || mesh.mesh.faces.size() < fewest->mesh.faces.size())
            fewest = std::move(mesh);
    }
    if (!best)
        throw_invalid("faces",
                      "about " + std::to_string(fewest->mesh.faces.size()) +
                          " or more, the fewest that were found, with a mesh at most " + to_text(fewest->distance) +
                          " from the surface",
                      faces);
    return *std::move(best);
}

/// Where gradients vanish: gives a vertex the mean normal of its faces, by their areas.
void set_missing_normals(SurfaceMesh& mesh)
{
    std::vector<bool> is_missing(mesh.normals.size());
    for (std::size_t i = 0; i < is_missing.size(); ++i)
        is_missing[i] = mesh.normals[i] == glm::dvec3(0.0);
    if (std::find(is_missing.begin(), is_missing.end(), true) == is_missing.end())
        return;
    for (const glm::uvec3& face : mesh.faces) {
        const glm::dvec3& a = mesh.vertices[face.x];
        const glm::dvec3 doubled_area = glm::cross(mesh.vertices[face.y] - a, mesh.vertices[face.z] - a);
        for (int corner = 0; corner < 3; ++corner)
            if (is_missing[face[corner]])
                mesh.normals[face[corner]] += doubled_area;
    }
    for (std::size_t i = 0; i < is_missing.size(); ++i) {
        glm::dvec3& normal = mesh.normals[i];
        const glm::dvec3 size = glm::abs(normal);
        if (const double largest = std::max({size.x, size.y, size.z}); is_missing[i] && largest > 0.0)
            normal = glm::normalize(normal / largest); // whose square is not too small
    }
}

/// Maps a mesh from lattice space to the world, and adds normals: those of the surface at `feet`, one for each vertex,
/// or at the vertices.
template <int Degree>
SurfaceMesh to_world(const IsosurfaceSnapshot& surface, LabeledMesh mesh, std::span<const glm::dvec3> feet,
                     const Progress& progress)
{
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    const LatticeField<Degree> field(surface, 1);
    const Volume& volume = surface.volume();
    SurfaceMesh result{std::move(mesh.vertices), {}, std::move(mesh.faces), unknown, {}, 0, unknown};
    result.normals.resize(result.vertices.size());

    // Vertices on caps only have a cap's normal.
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
                    set_surface_normal(hit, field.gradient(feet.empty() ? vertex : feet[i]), surface.options().inside,
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
    set_missing_normals(result);
    return result;
}

template <int Degree>
SurfaceMesh with_proof(const IsosurfaceSnapshot& surface, SimplifiedMesh simplified, const Progress& progress)
{
    std::vector<LeftOut> left_out =
        join_boxes(simplified.uncovered, simplified.mesh, surface.volume().lattice_to_world());
    SurfaceMesh result =
        to_world<Degree>(surface, std::move(simplified.mesh), simplified.feet, part_of(progress, 0.0, 0.5));
    result.distance = simplified.distance;
    result.missing_volume = simplified.missing_volume;
    result.left_out = std::move(left_out);
    result.crossings = find_crossings(result.vertices, result.faces, {}, part_of(progress, 0.5, 1.0)).size();
    return result;
}

} // namespace

SurfaceMesh to_mesh(const IsosurfaceSnapshot& surface, std::optional<double> tolerance, const Progress& progress)
{
    if (tolerance) {
        check_positive("tolerance", *tolerance);
        const double shortest = LatticeMetric(surface.volume().lattice_to_world()).shortest_edge;
        if (const double least = least_tolerance * shortest; *tolerance < (1.0 - 1e-5) * least) // as it is rounded
            throw_invalid("tolerance", to_text(least) + " or more, 2^-14 of a voxel's shortest edge", *tolerance);
        // Everything is within the diagonal of the volume's box. Larger tolerances mean the same, and could overflow.
        tolerance = std::min(*tolerance, glm::length(surface.volume().bounds().size()));
    }
    return dispatch_degree(surface.volume().degree(), [&](auto degree) {
        if (!tolerance) {
            LabeledMesh mesh = lattice_mesh<degree>(surface, part_of(progress, 0.0, 0.9));
            return to_world<degree>(surface, std::move(mesh), {}, part_of(progress, 0.9, 1.0));
        }
        const SurfaceParts parts(LatticeField<degree>(surface, 1), *tolerance, part_of(progress, 0.0, 0.03));
        const LabeledMesh fine = lattice_mesh<degree>(surface, parts, *tolerance, part_of(progress, 0.03, 0.3));
        SimplifiedMesh mesh = simplified_mesh<degree>(surface, parts, fine, *tolerance, part_of(progress, 0.3, 0.9));
        return with_proof<degree>(surface, std::move(mesh), part_of(progress, 0.9, 1.0));
    });
}

MeshParts::MeshParts(std::shared_ptr<const IsosurfaceSnapshot> surface, std::size_t cells)
    : surface_(std::move(surface)), end_(surface_->volume().cell_shape().z)
{
    const glm::ivec3 shape = surface_->volume().cell_shape();
    const std::size_t of_layer = static_cast<std::size_t>(shape.x) * static_cast<std::size_t>(shape.y);
    const std::size_t bricks = std::min(cells / (of_layer * brick_size), static_cast<std::size_t>(end_));
    layers_ = brick_size * std::max(static_cast<int>(bricks), 1);
}

std::optional<SurfaceMesh> MeshParts::next(const Progress& progress)
{
    if (next_ >= end_)
        return std::nullopt;
    const int first = std::exchange(next_, std::min(next_ + layers_, end_));
    const double size = end_;
    const Progress of_part = part_of(progress, first / size, next_ / size);
    return dispatch_degree(surface_->volume().degree(), [&](auto degree) {
        LabeledMesh mesh = lattice_mesh_of_layers<degree>(*surface_, first, next_, part_of(of_part, 0.0, 0.9));
        return std::optional(to_world<degree>(*surface_, std::move(mesh), {}, part_of(of_part, 0.9, 1.0)));
    });
}

SurfaceMesh to_mesh_of_faces(const IsosurfaceSnapshot& surface, std::size_t faces, const Progress& progress)
{
    if (faces == 0)
        throw_invalid("faces", "at least 1", faces);
    return dispatch_degree(surface.volume().degree(), [&](auto degree) {
        SimplifiedMesh mesh = mesh_of_faces<degree>(surface, faces, part_of(progress, 0.0, 0.95));
        return with_proof<degree>(surface, std::move(mesh), part_of(progress, 0.95, 1.0));
    });
}

} // namespace isospline
