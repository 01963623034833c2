// One run of simplify().
#pragma once

#include "isospline/polygonize/editable_mesh.h"
#include "isospline/polygonize/face_octree.h"
#include "isospline/polygonize/nearness.h"
#include "isospline/polygonize/simplify.h"
#include "isospline/query/lattice_metric.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

namespace isospline {

/// The sum of squared distances from planes, weighted by area, and the sum of the weights.
struct Quadric {
    glm::dmat3 a{0.0};
    glm::dvec3 b{0.0};
    double c = 0.0, weight = 0.0;

    void add_plane(const glm::dvec3& normal, double offset, double area)
    {
        a += area * glm::outerProduct(normal, normal);
        b -= area * offset * normal;
        c += area * offset * offset;
        weight += area;
    }
    void add(const Quadric& other)
    {
        a += other.a;
        b += other.b;
        c += other.c;
        weight += other.weight;
    }
    double mean_square(const glm::dvec3& x) const
    {
        return weight > 0.0 ? std::max(glm::dot(x, a * x) + 2.0 * glm::dot(b, x) + c, 0.0) / weight : 0.0;
    }
};

/// Whether a face has not become a line or a point.
inline bool is_left(const glm::uvec3& face)
{
    return face.x != face.y && face.y != face.z && face.z != face.x;
}

/// The queue has each vertex once, with the neighbor into which its collapse changes the mesh least.
template <int Degree>
class Simplification {
public:
    Simplification(const LatticeField<Degree>& field, LabeledMesh& mesh, const Simplicity& simplicity)
        : metric_(field.surface().volume().lattice_to_world()), simplicity_(simplicity),
          nearness_(field, metric_, simplicity.of_faces), lattice_(mesh.vertices),
          editable_(lattice_.size(), std::move(mesh.faces), std::move(mesh.labels)),
          octree_(bounds_of(lattice_), editable_.faces().size(), 0.125), world_(lattice_.size()),
          quadrics_(lattice_.size()), stamps_(lattice_.size(), 0), next_sample_(lattice_.size(), none),
          first_sample_(editable_.faces().size(), none), is_changing_(editable_.faces().size(), 0)
    {
        for (std::uint32_t face = 0; face < editable_.faces().size(); ++face)
            octree_.insert(face, box_of(editable_.faces()[face]));
        for (std::size_t i = 0; i < lattice_.size(); ++i)
            world_[i] = metric_.to_world * lattice_[i];
        for (const glm::uvec3& face : editable_.faces()) {
            const glm::dvec3 normal = glm::cross(world_[face.y] - world_[face.x], world_[face.z] - world_[face.x]);
            const double length = glm::length(normal);
            if (length > 0.0)
                for (int corner = 0; corner < 3; ++corner)
                    quadrics_[face[corner]].add_plane(normal / length, glm::dot(normal / length, world_[face.x]),
                                                      length);
        }
    }

    /// Repeats the collapses of an earlier run, except where locked vertices make the mesh a different one.
    void repeat(const std::vector<Collapse>& history, const Progress& progress);
    /// Collapses all edges that may be collapsed, the cheapest first.
    void run(const Progress& progress);
    std::vector<Collapse> finish(LabeledMesh& mesh) &&;

private:
    static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

    static Box bounds_of(const std::vector<glm::dvec3>& vertices)
    {
        Box bounds;
        for (const glm::dvec3& vertex : vertices)
            bounds.extend(vertex);
        return bounds;
    }
    Box box_of(const glm::uvec3& face) const
    {
        return {glm::min(glm::min(lattice_[face.x], lattice_[face.y]), lattice_[face.z]),
                glm::max(glm::max(lattice_[face.x], lattice_[face.y]), lattice_[face.z])};
    }

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

    /// Whether a vertex has to stay.
    bool is_locked(std::uint32_t vertex) const
    {
        return !simplicity_.locked.empty() && simplicity_.locked[vertex] != 0;
    }
    void find_neighbors(std::uint32_t vertex);
    void find_targets(std::uint32_t vertex);
    void push(std::uint32_t vertex);
    Corners corners(const std::vector<glm::dvec3>& positions, const glm::uvec3& face) const
    {
        return {positions[face.x], positions[face.y], positions[face.z]};
    }
    bool keeps_shape(std::uint32_t from, std::uint32_t to);
    bool is_near_surface(double spacing, bool (Nearness<Degree>::*is_near)(const glm::dvec3&, FaceLabel) const) const;
    bool crosses_others();
    bool find_faces_of_samples(std::uint32_t from);
    bool try_collapse(std::uint32_t from, std::uint32_t to);
    void collapse(std::uint32_t from, std::uint32_t to);

    LatticeMetric metric_;
    const Simplicity& simplicity_;
    Nearness<Degree> nearness_;
    std::vector<glm::dvec3> lattice_;
    EditableMesh editable_;
    FaceOctree octree_;
    std::vector<glm::dvec3> world_; ///< up to a translation
    std::vector<Quadric> quadrics_;
    std::vector<std::uint32_t> stamps_; ///< how often each vertex was pushed
    std::priority_queue<Candidate> queue_;
    // Each face has a linked list of the removed vertices nearest to it.
    std::vector<std::uint32_t> next_sample_, first_sample_;
    std::vector<Collapse> history_;
    std::vector<std::uint8_t> is_queued_; ///< vertices that may be collapsed; all if empty
    std::vector<std::uint32_t> neighbors_;
    std::vector<Target> targets_;                                ///< for one vertex, the cheapest first
    std::vector<std::pair<std::uint32_t, glm::uvec3>> changed_;  ///< faces that a collapse changes, after the change
    std::vector<glm::uvec3> others_;                             ///< faces that may cross those
    std::vector<std::uint8_t> is_changing_;                      ///< for each face: it is in `changed_`
    std::vector<std::pair<std::uint32_t, std::uint32_t>> moved_; ///< samples, and the face that each goes to
};

} // namespace isospline
