#include "isospline/polygonize/simplified_mesh.h"

#include "isospline/polygonize/covering.h"
#include "isospline/polygonize/editable_mesh.h"
#include "isospline/polygonize/face_octree.h"
#include "isospline/polygonize/mesh_proof.h"
#include "isospline/polygonize/simplification.h"
#include "isospline/polygonize/volume_preservation.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace isospline {

namespace {

/// Simplification leaves a part of the tolerance for points between those where it measures.
constexpr double part_of_faces = 0.9, part_of_vertices = 0.8;
/// How often a mesh is simplified, at most.
constexpr int most_attempts = 5;
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
    /// `fine` has the vertices of all meshes. It and the field must outlive the object.
    PreservedMeshes(const LatticeField<Degree>& field, const LabeledMesh& fine, double tolerance)
        : fine_(fine), reach_(box_of_ball(LatticeMetric(field.surface().volume().lattice_to_world()), tolerance)),
          preservation_(field, tolerance), proof_(field, tolerance), stays_(fine.vertices.size(), 0)
    {
    }

    /// Moves vertices of a mesh that has those of the fine mesh. `has_changed` tells which faces this one does not
    /// have. Boxes of what is not covered are as small as possible in the last proof only.
    void prove(LabeledMesh& mesh, const std::vector<std::uint8_t>& has_changed, bool is_last, const Progress& progress);

    const MeshProof<Degree>& proof() const { return proof_; }
    /// All for which the proof failed.
    std::vector<Box> failed(const LabeledMesh& mesh) const
    {
        std::vector<Box> boxes = proof_.failed(mesh);
        boxes.insert(boxes.end(), proof_.uncovered().begin(), proof_.uncovered().end());
        return boxes;
    }
    /// In the meshes that follow, vertices within a margin of boxes stay on the surface.
    void keep_near(const std::vector<Box>& boxes, double margin)
    {
        const std::vector<std::uint8_t> is_near = vertices_near(fine_.vertices, boxes, margin);
        for (std::size_t i = 0; i < stays_.size(); ++i)
            stays_[i] |= is_near[i];
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

    const LabeledMesh& fine_;
    glm::dvec3 reach_; ///< of the box around a ball with the tolerance as radius, in lattice space
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
        std::vector<std::uint8_t> is_new = has_changed;
        for (std::size_t i = 0; i < mesh.faces.size(); ++i)
            for (int corner = 0; corner < 3; ++corner)
                if (const std::uint32_t vertex = mesh.faces[i][corner]; mesh.vertices[vertex] != fine_.vertices[vertex])
                    is_new[i] = 1;
        proof_.examine(mesh, is_new, is_last, part_of(progress, 1.0 - 0.8 * left, 1.0 - 0.25 * left));
        if (!put_back(mesh, round >= most_single_rounds))
            return;
    }
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
SimplifiedMesh simplified_mesh(const IsosurfaceSnapshot& surface, const LabeledMesh& fine, double tolerance,
                               const Progress& progress)
{
    const LatticeField<Degree> field(surface, 1);
    const LatticeMetric metric(surface.volume().lattice_to_world());
    Simplification<Degree> simplification(field, fine, {part_of_faces * tolerance, part_of_vertices * tolerance});
    simplification.run(part_of(progress, 0.0, 0.5));
    PreservedMeshes<Degree> meshes(field, fine, tolerance);
    double margin = 0.5 * tolerance / metric.shortest_edge;
    for (int attempt = 1;; ++attempt) {
        const double left = std::pow(0.5, attempt); // most of the work is in the first attempt
        auto [mesh, has_changed] = simplification.mesh();
        meshes.prove(mesh, has_changed, attempt == most_attempts, part_of(progress, 1.0 - left, 1.0 - 0.75 * left));
        const std::vector<Box> failed = meshes.failed(mesh);
        if (failed.empty() || attempt == most_attempts) {
            std::vector<glm::dvec3> feet;
            for (const std::uint32_t vertex : drop_unused_vertices(mesh))
                feet.push_back(fine.vertices[vertex]);
            const double missing = meshes.missing_volume(mesh, part_of(progress, 1.0 - 0.75 * left, 1.0));
            return {std::move(mesh), std::move(feet), meshes.proof().distance(), meshes.proof().uncovered(), missing};
        }
        const Redo what = attempt == 1 ? Redo::vertices : attempt == 2 ? Redo::surrounding : Redo::surrounding_alone;
        if (what == Redo::surrounding_alone) {
            margin *= attempt == 3 ? 2.0 : 4.0; // one tolerance: half of it may hold no vertex; then four
            meshes.keep_near(failed, margin);
        }
        simplification.redo(failed, margin, meshes.proof().uncovered(), what,
                            part_of(progress, 1.0 - 0.75 * left, 1.0 - 0.5 * left));
    }
}

template SimplifiedMesh simplified_mesh<1>(const IsosurfaceSnapshot&, const LabeledMesh&, double, const Progress&);
template SimplifiedMesh simplified_mesh<2>(const IsosurfaceSnapshot&, const LabeledMesh&, double, const Progress&);
template SimplifiedMesh simplified_mesh<3>(const IsosurfaceSnapshot&, const LabeledMesh&, double, const Progress&);

} // namespace isospline
