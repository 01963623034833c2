#include "isospline/polygonize/surface_mesh.h"

#include "isospline/math/affine.h"
#include "isospline/polygonize/covering.h"
#include "isospline/polygonize/editable_mesh.h"
#include "isospline/polygonize/face_crossing.h"
#include "isospline/polygonize/face_distance.h"
#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/lattice_mesh.h"
#include "isospline/polygonize/left_out.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/simplification.h"
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
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_set>
#include <utility>
#include <vector>

namespace isospline {

namespace {

/// What is proven of the distance between a mesh and the surface that it stands for, in both directions. After a change
/// of a part of the mesh, only this part is examined again.
template <int Degree>
class MeshProof {
public:
    /// The field must outlive it. Distances are in world units.
    MeshProof(const LatticeField<Degree>& field, double tolerance) : field_(field), tolerance_(tolerance) {}

    /// Examines a mesh with the same vertices as the mesh before. Crossings of two faces that have not changed do not
    /// count. Boxes of what is not covered are as small as possible in the last examination only.
    void examine(const LabeledMesh& mesh, const std::vector<std::uint8_t>& has_changed, bool is_last,
                 const Progress& progress);

    /// A bound for the distance of all points of the mesh from the surface or a cap, and of all points of these that
    /// are not in `uncovered` from the mesh.
    double distance() const;
    /// Boxes in lattice space with surface that is not proven to be within the tolerance of the mesh.
    const std::vector<Box>& uncovered() const { return covering_.uncovered; }
    /// The boxes around faces that are not proven to be within the tolerance of the surface, or cross others.
    std::vector<Box> failed(const LabeledMesh& mesh) const;

private:
    struct ProvenFace {
        glm::uvec3 face;
        double distance;
        bool crosses_other;
    };

    static bool is_before(const ProvenFace& a, const ProvenFace& b);
    static ProvenFace* find(std::vector<ProvenFace>& faces, const glm::uvec3& face);

    const LatticeField<Degree>& field_;
    double tolerance_;
    Covering covering_;
    std::vector<ProvenFace> faces_; ///< sorted
    std::vector<std::array<std::uint32_t, 2>> crossings_;
};

template <int Degree>
bool MeshProof<Degree>::is_before(const ProvenFace& a, const ProvenFace& b)
{
    return std::tie(a.face.x, a.face.y, a.face.z) < std::tie(b.face.x, b.face.y, b.face.z);
}

template <int Degree>
typename MeshProof<Degree>::ProvenFace* MeshProof<Degree>::find(std::vector<ProvenFace>& faces, const glm::uvec3& face)
{
    const auto found = std::lower_bound(faces.begin(), faces.end(), ProvenFace{face, 0.0, false}, is_before);
    return found != faces.end() && found->face == face ? &*found : nullptr;
}

template <int Degree>
void MeshProof<Degree>::examine(const LabeledMesh& mesh, const std::vector<std::uint8_t>& has_changed, bool is_last,
                                const Progress& progress)
{
    // Faces cross others as before if neither is new.
    std::vector<std::uint8_t> may_cross = has_changed;
    // From the mesh to the surface: the faces that are new.
    std::vector<ProvenFace> faces;
    LabeledMesh added{mesh.vertices, {}, {}};
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
        const ProvenFace* const known = find(faces_, mesh.faces[i]);
        if (!faces_.empty())
            may_cross[i] = known == nullptr || known->crosses_other ? 1 : 0;
        if (known != nullptr) {
            faces.push_back({known->face, known->distance, false});
        } else {
            added.faces.push_back(mesh.faces[i]);
            added.labels.push_back(mesh.labels[i]);
        }
    }
    const std::vector<double> distances =
        distances_from_surface(field_, added, tolerance_, part_of(progress, 0.0, 0.6));
    for (std::size_t i = 0; i < distances.size(); ++i)
        faces.push_back({added.faces[i], distances[i], false});
    std::sort(faces.begin(), faces.end(), is_before);

    // From the surface to the mesh: the cells around faces that are gone.
    CellFilter filter;
    std::unordered_set<CrossingKey> changed;
    const LatticeMetric metric(field_.surface().volume().lattice_to_world());
    const glm::dvec3 reach = box_of_ball(metric, tolerance_);
    if (!faces_.empty()) {
        std::vector<Box> boxes = covering_.uncovered;
        for (const ProvenFace& proven : faces_)
            if (find(faces, proven.face) == nullptr) {
                const Box box = box_of(mesh.vertices, proven.face);
                boxes.push_back({box.lower - reach, box.upper + reach});
            }
        changed = cubes_of(boxes, 1.0, 0.0);
        filter = [&changed](const glm::ivec3& cell) { return changed.count(crossing_key(cell, 0)) != 0; };
    }
    const double least_edge = least_edge_of(metric, tolerance_);
    const double reported = is_last ? 0.0 : std::max(2.0 * least_edge, 0.125 * std::min({reach.x, reach.y, reach.z}));
    Covering covering =
        cover_surface(field_, mesh, tolerance_, {least_edge, reported}, filter, part_of(progress, 0.6, 0.95));
    covering.distance = std::max(covering.distance, covering_.distance);
    crossings_ = find_crossings(mesh.vertices, mesh.faces, may_cross, part_of(progress, 0.95, 1.0));
    std::erase_if(crossings_, [&](const std::array<std::uint32_t, 2>& pair) {
        return has_changed[pair[0]] == 0 && has_changed[pair[1]] == 0;
    });
    for (const auto& pair : crossings_)
        for (const std::uint32_t face : pair)
            find(faces, mesh.faces[face])->crosses_other = true;
    covering_ = std::move(covering);
    faces_ = std::move(faces);
}

template <int Degree>
double MeshProof<Degree>::distance() const
{
    double most = covering_.distance;
    for (const ProvenFace& proven : faces_)
        most = std::max(most, proven.distance);
    return most;
}

template <int Degree>
std::vector<Box> MeshProof<Degree>::failed(const LabeledMesh& mesh) const
{
    std::vector<Box> boxes;
    for (const ProvenFace& proven : faces_)
        if (proven.distance > tolerance_)
            boxes.push_back(box_of(mesh.vertices, proven.face));
    for (const auto& [first, second] : crossings_) {
        const Box a = box_of(mesh.vertices, mesh.faces[first]), b = box_of(mesh.vertices, mesh.faces[second]);
        boxes.push_back({glm::max(a.lower, b.lower), glm::min(a.upper, b.upper)});
    }
    return boxes;
}

/// A mesh with few faces, and what is proven of it. Locations are in lattice space.
struct SimplifiedMesh {
    LabeledMesh mesh;
    double distance;
    std::vector<Box> uncovered;
};

// The mesh of the lattice leaves a part of the tolerance for simplification, which leaves a part for points between
// those where it measures.
constexpr double part_of_lattice = 0.8, part_of_faces = 0.9, part_of_vertices = 0.8;
/// The smallest tolerance for a number of faces, in voxels: parts of the surface between the nodes of the finest
/// lattice can be left out.
constexpr double finest_tolerance = 1.0 / 32.0;
/// The smallest tolerance that may be asked for, in voxels: edges of 1/32 are this far from an arc whose radius is two
/// voxels.
constexpr double least_tolerance = 0x1p-14;

/// Simplifies the mesh of a lattice for this tolerance or a smaller one.
template <int Degree>
SimplifiedMesh simplified_mesh(const IsosurfaceSnapshot& surface, const LabeledMesh& fine, double tolerance,
                               const Progress& progress)
{
    constexpr int attempts = 5;
    const LatticeField<Degree> field(surface, 1);
    const LatticeMetric metric(surface.volume().lattice_to_world());
    Simplification<Degree> simplification(field, fine, {part_of_faces * tolerance, part_of_vertices * tolerance});
    simplification.run(part_of(progress, 0.0, 0.5));
    MeshProof<Degree> proof(field, tolerance);
    double margin = 0.5 * tolerance / metric.shortest_edge;
    for (int attempt = 1;; ++attempt) {
        const double left = std::pow(0.5, attempt); // most of the work is in the first attempt
        auto [mesh, has_changed] = simplification.mesh();
        proof.examine(mesh, has_changed, attempt == attempts, part_of(progress, 1.0 - left, 1.0 - 0.75 * left));
        std::vector<Box> failed = proof.failed(mesh);
        const std::vector<Box>& uncovered = proof.uncovered();
        failed.insert(failed.end(), uncovered.begin(), uncovered.end());
        if (failed.empty() || attempt == attempts) {
            drop_unused_vertices(mesh);
            return {std::move(mesh), proof.distance(), uncovered};
        }
        const Redo what = attempt == 1 ? Redo::vertices : attempt == 2 ? Redo::surrounding : Redo::surrounding_alone;
        simplification.redo(failed, margin, uncovered, what, part_of(progress, 1.0 - 0.75 * left, 1.0 - 0.5 * left));
        if (what == Redo::surrounding_alone)
            margin *= 8.0;
    }
}

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
        const LabeledMesh plain = lattice_mesh<Degree>(surface, {}, part_of(progress, 0.0, begin));
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
        // The lattice for a slightly smaller tolerance serves as well.
        constexpr double most_too_fine = 4.0;
        if (!(tolerance_of_fine <= tolerance && tolerance <= most_too_fine * tolerance_of_fine)) {
            fine = lattice_mesh<Degree>(surface, part_of_lattice * tolerance, part_of(of_mesh, 0.0, 0.5));
            tolerance_of_fine = tolerance;
        }
        SimplifiedMesh mesh = simplified_mesh<Degree>(surface, fine, tolerance, part_of(of_mesh, 0.5, 1.0));
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

template <int Degree>
SurfaceMesh with_proof(const IsosurfaceSnapshot& surface, SimplifiedMesh simplified, const Progress& progress)
{
    std::vector<LeftOut> left_out =
        join_boxes(simplified.uncovered, simplified.mesh, surface.volume().lattice_to_world());
    SurfaceMesh result = to_world<Degree>(surface, std::move(simplified.mesh), part_of(progress, 0.0, 0.5));
    result.distance = simplified.distance;
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
            LabeledMesh mesh = lattice_mesh<degree>(surface, {}, part_of(progress, 0.0, 0.9));
            return to_world<degree>(surface, std::move(mesh), part_of(progress, 0.9, 1.0));
        }
        const LabeledMesh fine =
            lattice_mesh<degree>(surface, part_of_lattice * *tolerance, part_of(progress, 0.0, 0.3));
        SimplifiedMesh mesh = simplified_mesh<degree>(surface, fine, *tolerance, part_of(progress, 0.3, 0.9));
        return with_proof<degree>(surface, std::move(mesh), part_of(progress, 0.9, 1.0));
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
