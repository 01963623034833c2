// What is proven of a mesh with a tolerance.
#pragma once

#include "isospline/math/box.h"
#include "isospline/polygonize/covering.h"
#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace isospline {

/// What is proven of the distance between a mesh and the surface that it stands for, in both directions. After a change
/// of a part of the mesh, only this part is examined again.
template <int Degree>
class MeshProof {
public:
    /// The field and the parts must outlive it. Distances are in world units.
    MeshProof(const LatticeField<Degree>& field, const SurfaceParts& parts, double tolerance)
        : field_(field), parts_(parts), tolerance_(tolerance)
    {
    }

    /// Examines a mesh with as many vertices as the mesh before. Crossings of two faces that have not changed do not
    /// count. Boxes of what is not covered are as small as possible, and distances beyond the tolerance are finite, in
    /// the last examination only.
    void examine(const LabeledMesh& mesh, const std::vector<std::uint8_t>& has_changed, bool is_last,
                 const Progress& progress);

    /// A bound for the distance of all points of the mesh from the surface or a cap, and of all points of these that
    /// are not in `uncovered` from the mesh.
    double distance() const;
    /// Boxes in lattice space with surface that is not proven to be within the tolerance of the mesh.
    const std::vector<Box>& uncovered() const { return covering_.uncovered; }
    /// The boxes around changed faces that are not proven to be within the tolerance of the surface, or cross others.
    std::vector<Box> failed(const LabeledMesh& mesh) const;
    /// Sets the flags of the vertices of these faces.
    void mark_failed(const LabeledMesh& mesh, std::vector<std::uint8_t>& flags) const;

private:
    struct ProvenFace {
        glm::uvec3 face;
        double distance;
        bool has_changed;
        bool crosses_other = false;
    };

    static bool is_before(const ProvenFace& a, const ProvenFace& b);
    static ProvenFace* find(std::vector<ProvenFace>& faces, const glm::uvec3& face);
    /// What is known of a face of the mesh, or null if it is new or has moved.
    ProvenFace* find_known(const LabeledMesh& mesh, const glm::uvec3& face);

    const LatticeField<Degree>& field_;
    const SurfaceParts& parts_;
    double tolerance_;
    Covering covering_;
    std::vector<glm::dvec3> vertices_; ///< of the mesh before
    std::vector<ProvenFace> faces_;    ///< sorted
    std::vector<std::array<std::uint32_t, 2>> crossings_;
};

} // namespace isospline
