// Collapses of edges in a block of a mesh.
#pragma once

#include "isospline/math/box.h"
#include "isospline/polygonize/collapsing_mesh.h"
#include "isospline/polygonize/face_octree.h"
#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/nearness.h"
#include "isospline/query/lattice_metric.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

namespace isospline {

/// How far simplification may go, in world units.
struct Simplicity {
    double of_faces;    ///< largest measured distance of a changed face from the surface
    double of_vertices; ///< largest distance of a sample from the nearest face around
};

/// How much is measured before a collapse.
struct Care {
    double spacing;    ///< of points on changed faces, in cells
    bool of_crossings; ///< whether changed faces cross others of the block
};

/// Collapses edges of a block, those that change it least first. The queue has each vertex once, with the neighbor into
/// which its collapse changes the mesh least.
template <int Degree>
class EdgeCollapser {
public:
    EdgeCollapser(const LatticeField<Degree>& field, const SurfaceParts& parts, const LatticeMetric& metric,
                  const Simplicity& simplicity, CollapsingMesh& mesh, std::uint32_t block, Care care)
        : metric_(metric), simplicity_(simplicity), nearness_(field, metric, simplicity.of_faces, &parts), mesh_(mesh),
          block_(block), care_(care)
    {
    }

    /// Collapses all edges at inner vertices that may be collapsed, beginning with these vertices. Returns the
    /// collapses. With care of crossings, `faces` are those at vertices of the block.
    std::vector<Collapse> run(const std::vector<std::uint32_t>& vertices, const std::vector<std::uint32_t>& faces,
                              const Progress& progress);

    /// Does a collapse of an earlier run if it is still possible. Samples are not kept.
    bool repeat(const Collapse& collapse);

private:
    struct Target {
        double cost;
        std::uint32_t vertex;

        bool operator<(const Target& other) const
        {
            return std::tie(cost, vertex) < std::tie(other.cost, other.vertex);
        }
    };
    struct Candidate {
        double cost;
        std::uint32_t vertex, stamp;

        bool operator<(const Candidate& other) const // the smallest cost is on top
        {
            return std::tie(cost, vertex) > std::tie(other.cost, other.vertex);
        }
    };

    struct BoxedFace {
        Box box;
        glm::uvec3 face;
    };

    void insert_faces(const std::vector<std::uint32_t>& faces);
    void find_targets(std::uint32_t vertex);
    void push(std::uint32_t vertex);
    bool keeps_shape(std::uint32_t from, std::uint32_t to);
    bool is_near_surface(double spacing, bool (Nearness<Degree>::*is_near)(const glm::dvec3&, FaceLabel) const) const;
    bool crosses_others();
    bool find_faces_of_samples(std::uint32_t from);
    bool try_collapse(std::uint32_t from, std::uint32_t to);
    void collapse(std::uint32_t from, std::uint32_t to);

    const LatticeMetric& metric_;
    const Simplicity& simplicity_;
    Nearness<Degree> nearness_;
    CollapsingMesh& mesh_;
    std::uint32_t block_;
    Care care_;
    std::priority_queue<Candidate> queue_;
    std::vector<Collapse> done_;
    std::optional<FaceOctree> octree_;        ///< of the faces of the block
    std::vector<std::uint32_t> face_of_item_; ///< in the octree

    EditableMesh::Workspace workspace_;
    std::vector<std::uint32_t> neighbors_;
    std::vector<Target> targets_;                                ///< for one vertex, the cheapest first
    std::vector<std::pair<std::uint32_t, glm::uvec3>> changed_;  ///< faces that a collapse changes, after the change
    std::vector<BoxedFace> others_;                              ///< these, then faces that they may cross
    std::vector<std::pair<std::uint32_t, std::uint32_t>> moved_; ///< samples, and the face that each goes to
};

} // namespace isospline
