// Proof of the distance between a mesh and the surface that it stands for, in both directions.
#pragma once

#include "isospline/polygonize/covering.h"
#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/mesh_part.h"

#include <vector>

namespace isospline {

/// What is proven of a mesh. After a change of a part of the mesh, only this part is examined again.
template <int Degree>
class MeshProof {
public:
    /// The field must outlive it. Distances are in world units.
    MeshProof(const LatticeField<Degree>& field, double tolerance) : field_(field), tolerance_(tolerance) {}

    /// Examines a mesh with the same vertices as the mesh before.
    void examine(const LabeledMesh& mesh, const Progress& progress);

    /// A bound for the distance of all points of the mesh from the surface or a cap, and of all points of these that
    /// are not in `uncovered` from the mesh.
    double distance() const;
    /// Boxes in lattice space with surface that is not proven to be within the tolerance of the mesh.
    const std::vector<Box>& uncovered() const { return covering_.uncovered; }
    /// These, and the boxes around faces that are not proven to be within the tolerance of the surface.
    std::vector<Box> failed(const LabeledMesh& mesh) const;

private:
    struct ProvenFace {
        glm::uvec3 face;
        double distance;
    };

    static bool is_before(const ProvenFace& a, const ProvenFace& b);
    const ProvenFace* find(const std::vector<ProvenFace>& faces, const glm::uvec3& face) const;

    const LatticeField<Degree>& field_;
    double tolerance_;
    Covering covering_;
    std::vector<ProvenFace> faces_; ///< sorted
};

} // namespace isospline
