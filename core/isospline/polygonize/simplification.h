// Simplification of a mesh within a distance from the surface.
#pragma once

#include "isospline/polygonize/collapsing_mesh.h"
#include "isospline/polygonize/edge_collapser.h"
#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/query/lattice_metric.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace isospline {

/// Collapses edges of a mesh, those that change it least first (M. Garland, P. Heckbert, "Surface simplification using
/// quadric error metrics", SIGGRAPH 1997). Remaining vertices do not move. A collapse is done only if each face that it
/// changes is measured to be near the surface (Nearness), and samples of the surface are near these faces.
///
/// What is measured is no proof. Where a proof fails, the mesh goes back to the first one, and is simplified again with
/// more care, and with still more where it fails again. The result does not depend on the number of threads.
template <int Degree>
class Simplification {
public:
    /// The field, the parts and the mesh must outlive it.
    Simplification(const LatticeField<Degree>& field, const SurfaceParts& parts, const LabeledMesh& fine,
                   const Simplicity& simplicity);

    /// Collapses all edges that may be collapsed.
    void run(const Progress& progress);
    /// Does so again near boxes in lattice space, with the care for places where proofs have failed `least_failures`
    /// times before, or more often. The middles of `samples` become samples of the surface.
    void redo(const std::vector<Box>& boxes, std::uint8_t least_failures, const std::vector<Box>& samples,
              const Progress& progress);
    /// For each vertex, whether it is not collapsed any more.
    const std::vector<std::uint8_t>& locked() const { return is_locked_; }
    /// The faces that are left, with all vertices of the first mesh, and for each face, whether it has changed.
    std::pair<LabeledMesh, std::vector<std::uint8_t>> mesh() const;

private:
    void choose_changes(const std::vector<Box>& boxes, std::uint8_t least_failures);
    void repeat(const Progress& progress);
    void assign_samples(const Progress& progress);
    void run_blocks(const Care& care, const Progress& progress);
    void divide(std::optional<double> offset);
    void run_divided(const Care& care, const Progress& progress);

    const LatticeField<Degree>& field_;
    const SurfaceParts& parts_;
    LatticeMetric metric_;
    const LabeledMesh& fine_;
    Simplicity simplicity_;
    std::vector<glm::dvec3> world_; ///< positions of vertices and other samples, up to a translation
    std::vector<std::uint8_t> is_locked_;
    std::vector<Box> failed_;            ///< where the proof has failed
    std::vector<std::uint8_t> failures_; ///< how often before, for each of these boxes
    std::vector<std::uint8_t> change_;   ///< what redo() does with each vertex
    std::vector<Collapse> history_;
    std::optional<CollapsingMesh> state_;
    std::uint32_t block_count_ = 1;
};

} // namespace isospline
