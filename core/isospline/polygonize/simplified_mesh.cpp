#include "isospline/polygonize/simplified_mesh.h"

#include "isospline/polygonize/cells_in_question.h"
#include "isospline/polygonize/covering.h"
#include "isospline/polygonize/editable_mesh.h"
#include "isospline/polygonize/face_octree.h"
#include "isospline/polygonize/mesh_proof.h"
#include "isospline/polygonize/simplification.h"
#include "isospline/polygonize/volume_preservation.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>

namespace isospline {

namespace {

/// Simplification leaves a part of the tolerance for points between those where it measures.
constexpr double part_of_faces = 0.9, part_of_vertices = 0.8;
/// How often a mesh is simplified, at most.
constexpr int most_attempts = 8;
/// After this number of proofs, neighbours of vertices that are put back are put back, too.
constexpr int most_single_rounds = 8;
/// The cosine of the largest angle by which a face is turned when its vertices move.
constexpr double least_cosine = 0.5;
/// Faces with less area for their size have no reliable normal.
constexpr double least_shape = 0.02;

/// Moves the vertices of simplified meshes so that they keep the volume, and proves the result. Where the proof fails,
/// vertices stay on the surface.
template <int Degree>
class PreservedMeshes {
public:
    /// `fine` has the vertices of all meshes. It, the field and the parts must outlive the object.
    PreservedMeshes(const LatticeField<Degree>& field, const SurfaceParts& parts, const LabeledMesh& fine,
                    double tolerance)
        : field_(field), parts_(parts), fine_(fine), tolerance_(tolerance),
          reach_(box_of_ball(LatticeMetric(field.surface().volume().lattice_to_world()), tolerance)),
          preservation_(field, tolerance), proof_(field, parts, tolerance), stays_(fine.vertices.size(), 0)
    {
    }

    /// Moves vertices of a mesh that has those of the fine mesh, and examines it. `has_changed` tells which faces the
    /// fine mesh does not have. Boxes of what is not covered are as small as possible in the last examination only.
    void prove(LabeledMesh& mesh, const std::vector<std::uint8_t>& has_changed, bool is_last, const Progress& progress);
    /// Examines a mesh whose vertices have been moved.
    void examine(const LabeledMesh& mesh, const std::vector<std::uint8_t>& has_changed, bool is_last,
                 const Progress& progress);
    /// Finds which of the surface that is not covered is not covered by the fine mesh either.
    void find_gaps(const Progress& progress);

    const MeshProof<Degree>& proof() const { return proof_; }
    /// Boxes with surface that the last mesh does not cover, without the gaps that have been found.
    std::vector<Box> uncovered() const;
    /// All for which the proof failed, without these gaps and faces of the fine mesh.
    std::vector<Box> failed(const LabeledMesh& mesh) const
    {
        std::vector<Box> boxes = proof_.failed(mesh), others = uncovered();
        boxes.insert(boxes.end(), others.begin(), others.end());
        return boxes;
    }
    /// In the meshes that follow, these vertices stay on the surface.
    void keep(const std::vector<std::uint8_t>& is_kept)
    {
        for (std::size_t i = 0; i < stays_.size(); ++i)
            stays_[i] |= is_kept[i];
    }
    double missing_volume(const LabeledMesh& mesh, const Progress& progress) const
    {
        return preservation_.missing_volume(mesh, progress);
    }

private:
    /// Makes vertices of faces stay for which the proof failed, or which are turned. Returns whether any of them had
    /// been moved.
    bool put_back(const LabeledMesh& mesh, bool with_neighbors);
    bool is_turned(const LabeledMesh& mesh, const glm::uvec3& face) const;

    const LatticeField<Degree>& field_;
    const SurfaceParts& parts_;
    const LabeledMesh& fine_;
    double tolerance_;
    glm::dvec3 reach_; ///< of the box around a ball with the tolerance as radius, in lattice space
    std::vector<Box> gaps_;
    VolumePreservation<Degree> preservation_;
    MeshProof<Degree> proof_;
    std::vector<std::uint8_t> stays_;
};

template <int Degree>
void PreservedMeshes<Degree>::prove(LabeledMesh& mesh, const std::vector<std::uint8_t>& has_changed, bool is_last,
                                    const Progress& progress)
{
    for (int round = 1;; ++round) {
        const double left = std::pow(0.25, round - 1);
        mesh.vertices = fine_.vertices;
        preservation_.move(mesh, stays_, part_of(progress, 1.0 - left, 1.0 - 0.8 * left));
        examine(mesh, has_changed, is_last, part_of(progress, 1.0 - 0.8 * left, 1.0 - 0.25 * left));
        if (!put_back(mesh, round >= most_single_rounds))
            return;
    }
}

template <int Degree>
void PreservedMeshes<Degree>::examine(const LabeledMesh& mesh, const std::vector<std::uint8_t>& has_changed,
                                      bool is_last, const Progress& progress)
{
    std::vector<std::uint8_t> is_new = has_changed;
    for (std::size_t i = 0; i < mesh.faces.size(); ++i)
        for (int corner = 0; corner < 3; ++corner)
            if (const std::uint32_t vertex = mesh.faces[i][corner]; mesh.vertices[vertex] != fine_.vertices[vertex])
                is_new[i] = 1;
    proof_.examine(mesh, is_new, is_last, progress);
}

template <int Degree>
void PreservedMeshes<Degree>::find_gaps(const Progress& progress)
{
    const std::vector<Box> boxes = uncovered();
    if (boxes.empty())
        return;
    const ChosenCells cells(boxes, 0.0, field_.surface().volume().cell_shape());
    const double least = least_edge_of(LatticeMetric(field_.surface().volume().lattice_to_world()), tolerance_);
    const Covering covering =
        cover_surface<Degree>(field_, parts_, fine_, tolerance_, {least, 0.0}, cells.filter(), progress);
    gaps_.insert(gaps_.end(), covering.uncovered.begin(), covering.uncovered.end());
}

template <int Degree>
std::vector<Box> PreservedMeshes<Degree>::uncovered() const
{
    const FaceOctree octree = octree_of(gaps_, 0.125);
    std::vector<Box> boxes;
    std::copy_if(proof_.uncovered().begin(), proof_.uncovered().end(), std::back_inserter(boxes), [&](const Box& box) {
        return octree.visit(box, [&](std::uint32_t gap) { return !gaps_[gap].overlaps(box); });
    });
    return boxes;
}

/// Whether a face is turned by more than a collapse may turn it.
template <int Degree>
bool PreservedMeshes<Degree>::is_turned(const LabeledMesh& mesh, const glm::uvec3& face) const
{
    const auto normal = [&](const std::vector<glm::dvec3>& vertices) {
        return glm::cross(vertices[face.y] - vertices[face.x], vertices[face.z] - vertices[face.x]);
    };
    const glm::dvec3 before = normal(fine_.vertices), after = normal(mesh.vertices),
                     size = box_of(fine_.vertices, face).size();
    return glm::length(before) > least_shape * glm::dot(size, size) &&
           glm::dot(before, after) < least_cosine * glm::length(before) * glm::length(after);
}

template <int Degree>
bool PreservedMeshes<Degree>::put_back(const LabeledMesh& mesh, bool with_neighbors)
{
    const std::vector<Box>& uncovered = proof_.uncovered();
    const FaceOctree octree = octree_of(uncovered, 0.125);
    std::vector<std::uint8_t> has_failed(stays_.size(), 0);
    const auto mark = [&](const glm::uvec3& face) { has_failed[face.x] = has_failed[face.y] = has_failed[face.z] = 1; };
    proof_.mark_failed(mesh, has_failed);
    for (const glm::uvec3& face : mesh.faces) {
        const Box box = box_of(mesh.vertices, face), reach{box.lower - reach_, box.upper + reach_};
        if (is_turned(mesh, face) || !octree.visit(reach, [&](std::uint32_t i) { return !uncovered[i].meets(reach); }))
            mark(face);
    }
    if (with_neighbors) {
        const std::vector<std::uint8_t> before = has_failed;
        for (const glm::uvec3& face : mesh.faces)
            if (before[face.x] != 0 || before[face.y] != 0 || before[face.z] != 0)
                mark(face);
    }
    bool is_any_moved = false;
    for (std::size_t i = 0; i < stays_.size(); ++i)
        if (has_failed[i] != 0 && mesh.vertices[i] != fine_.vertices[i])
            stays_[i] = is_any_moved = true;
    return is_any_moved;
}

} // namespace

template <int Degree>
SimplifiedMesh simplified_mesh(const IsosurfaceSnapshot& surface, const SurfaceParts& parts, const LabeledMesh& fine,
                               double tolerance, const Progress& progress)
{
    const LatticeField<Degree> field(surface, 1);
    Simplification<Degree> simplification(field, parts, fine,
                                          {part_of_faces * tolerance, part_of_vertices * tolerance});
    simplification.run(part_of(progress, 0.0, 0.5));
    PreservedMeshes<Degree> meshes(field, parts, fine, tolerance);
    for (int attempt = 1;; ++attempt) {
        // Most of the work is in the first attempt.
        const auto part = [&progress, left = std::pow(0.5, attempt)](double begin, double end) {
            return part_of(progress, 1.0 - left * (1.0 - begin), 1.0 - left * (1.0 - end));
        };
        auto [mesh, has_changed] = simplification.mesh();
        meshes.prove(mesh, has_changed, attempt == most_attempts, part(0.0, 0.2));
        if (attempt % 2 == 0)
            meshes.find_gaps(part(0.2, 0.25));
        const std::vector<Box> failed = meshes.failed(mesh);
        if (failed.empty() || attempt == most_attempts) {
            if (attempt != most_attempts &&
                (!meshes.proof().uncovered().empty() || meshes.proof().distance() > tolerance))
                meshes.examine(mesh, has_changed, true, part(0.25, 0.5));
            std::vector<glm::dvec3> feet;
            for (const std::uint32_t vertex : drop_unused_vertices(mesh))
                feet.push_back(fine.vertices[vertex]);
            const double missing = meshes.missing_volume(mesh, part(0.5, 1.0));
            return {std::move(mesh), std::move(feet), meshes.proof().distance(), meshes.proof().uncovered(), missing};
        }
        // So that no place fails for the first time in the last attempt.
        const int least_failures = std::max(0, attempt + 4 - most_attempts);
        simplification.redo(failed, static_cast<std::uint8_t>(least_failures), meshes.uncovered(), part(0.25, 0.5));
        meshes.keep(simplification.locked());
    }
}

template SimplifiedMesh simplified_mesh<1>(const IsosurfaceSnapshot&, const SurfaceParts&, const LabeledMesh&, double,
                                           const Progress&);
template SimplifiedMesh simplified_mesh<2>(const IsosurfaceSnapshot&, const SurfaceParts&, const LabeledMesh&, double,
                                           const Progress&);
template SimplifiedMesh simplified_mesh<3>(const IsosurfaceSnapshot&, const SurfaceParts&, const LabeledMesh&, double,
                                           const Progress&);

} // namespace isospline
