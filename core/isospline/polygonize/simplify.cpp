#include "isospline/polygonize/simplify.h"

#include "isospline/math/point_triangle.h"
#include "isospline/polygonize/editable_mesh.h"
#include "isospline/polygonize/merge_vertices.h"
#include "isospline/polygonize/nearness.h"
#include "isospline/query/lattice_metric.h"
#include "isospline/util/progress.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

namespace isospline {

namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

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

bool is_left(const glm::uvec3& face)
{
    return face.x != face.y && face.y != face.z && face.z != face.x;
}

/// One run of simplify(). The queue has each vertex once, with the neighbor into which its collapse changes the mesh
/// least.
template <int Degree>
class Simplification {
public:
    Simplification(const LatticeField<Degree>& field, LabeledMesh& mesh, double tolerance)
        : metric_(field.surface().volume().lattice_to_world()), tolerance_(tolerance),
          nearness_(field, metric_, tolerance), lattice_(mesh.vertices),
          editable_(lattice_.size(), std::move(mesh.faces), std::move(mesh.labels)), world_(lattice_.size()),
          quadrics_(lattice_.size()), stamps_(lattice_.size(), 0), next_sample_(lattice_.size(), none),
          first_sample_(editable_.faces().size(), none)
    {
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

    void run(const Progress& progress);
    double finish(LabeledMesh& mesh) &&;

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

    void find_neighbors(std::uint32_t vertex);
    void find_targets(std::uint32_t vertex);
    void push(std::uint32_t vertex);
    Corners corners(const std::vector<glm::dvec3>& positions, const glm::uvec3& face) const
    {
        return {positions[face.x], positions[face.y], positions[face.z]};
    }
    bool keeps_shape(std::uint32_t from, std::uint32_t to);
    bool is_near_surface(double spacing, bool (Nearness<Degree>::*is_near)(const glm::dvec3&) const) const;
    bool try_collapse(std::uint32_t from, std::uint32_t to);

    LatticeMetric metric_;
    double tolerance_;
    Nearness<Degree> nearness_;
    std::vector<glm::dvec3> lattice_;
    EditableMesh editable_;
    std::vector<glm::dvec3> world_; ///< up to a translation
    std::vector<Quadric> quadrics_;
    std::vector<std::uint32_t> stamps_; ///< how often each vertex was pushed
    std::priority_queue<Candidate> queue_;
    // Each face has a linked list of the removed vertices nearest to it.
    std::vector<std::uint32_t> next_sample_, first_sample_;
    std::vector<std::uint32_t> neighbors_;
    std::vector<Target> targets_;                                ///< for one vertex, the cheapest first
    std::vector<std::pair<std::uint32_t, glm::uvec3>> changed_;  ///< faces that a collapse changes, after the change
    std::vector<std::pair<std::uint32_t, std::uint32_t>> moved_; ///< samples, and the face that each goes to
};

template <int Degree>
void Simplification<Degree>::find_neighbors(std::uint32_t vertex)
{
    neighbors_.clear();
    for (const std::uint32_t index : editable_.faces_of(vertex))
        for (int corner = 0; corner < 3; ++corner)
            if (const std::uint32_t other = editable_.faces()[index][corner]; other != vertex)
                neighbors_.push_back(other);
    std::sort(neighbors_.begin(), neighbors_.end());
    neighbors_.erase(std::unique(neighbors_.begin(), neighbors_.end()), neighbors_.end());
}

template <int Degree>
void Simplification<Degree>::find_targets(std::uint32_t vertex)
{
    find_neighbors(vertex);
    targets_.clear();
    for (const std::uint32_t other : neighbors_) {
        const double mean_square = quadrics_[vertex].mean_square(world_[other]);
        const glm::dvec3 edge = world_[other] - world_[vertex];
        if (mean_square <= tolerance_ * tolerance_)
            targets_.push_back({mean_square + 1e-6 * glm::dot(edge, edge), other});
    }
    std::sort(targets_.begin(), targets_.end());
}

template <int Degree>
void Simplification<Degree>::push(std::uint32_t vertex)
{
    find_targets(vertex);
    ++stamps_[vertex];
    if (!targets_.empty())
        queue_.push({targets_.front().cost, vertex, stamps_[vertex]});
}

/// Whether no face is flipped, or becomes much thinner.
template <int Degree>
bool Simplification<Degree>::keeps_shape(std::uint32_t from, std::uint32_t to)
{
    changed_.clear();
    for (const std::uint32_t index : editable_.faces_of(from)) {
        const glm::uvec3 before = editable_.faces()[index];
        glm::uvec3 after = before;
        for (int corner = 0; corner < 3; ++corner)
            if (before[corner] == from)
                after[corner] = to;
        changed_.push_back({index, after});
        if (!is_left(after))
            continue;
        const auto shape_of = [&](const glm::uvec3& face) {
            const auto [a, b, c] = corners(world_, face);
            const double longest = std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
            return std::pair(glm::cross(b - a, c - a), longest);
        };
        const auto [old_area, old_longest] = shape_of(before);
        const auto [new_area, new_longest] = shape_of(after);
        const double old_length = glm::length(old_area), new_length = glm::length(new_area);
        constexpr double least_shape = 0.02, least_cosine = 0.5;
        if (!(new_length > least_shape * new_longest) && new_length * old_longest <= old_length * new_longest)
            return false;
        if (old_length > 1e-3 * old_longest && !(glm::dot(old_area, new_area) > least_cosine * old_length * new_length))
            return false;
    }
    return true;
}

/// Checks the faces that a collapse changes.
template <int Degree>
bool Simplification<Degree>::is_near_surface(double spacing,
                                             bool (Nearness<Degree>::*is_near)(const glm::dvec3&) const) const
{
    return std::all_of(changed_.begin(), changed_.end(), [&](const auto& change) {
        const auto& [index, face] = change;
        return !is_left(face) || editable_.labels()[index] != on_isosurface ||
               for_each_sample(corners(lattice_, face), spacing,
                               [&](const glm::dvec3& at) { return (nearness_.*is_near)(at); });
    });
}

template <int Degree>
bool Simplification<Degree>::try_collapse(std::uint32_t from, std::uint32_t to)
{
    if (!editable_.can_collapse(from, to) || !keeps_shape(from, to))
        return false;
    // A cheap estimate at few points rules out most collapses that exceed the tolerance.
    constexpr double first_spacing = 2.0;
    if (!is_near_surface(first_spacing, &Nearness<Degree>::is_likely))
        return false;

    // Each sample goes to the face that is nearest to it.
    moved_.clear();
    const auto find_face = [&](std::uint32_t sample) {
        double least = std::numeric_limits<double>::infinity();
        std::uint32_t nearest = none;
        for (const auto& [index, face] : changed_) {
            if (!is_left(face))
                continue;
            const auto [a, b, c] = corners(world_, face);
            const glm::dvec3 difference = world_[sample] - closest_point_of_triangle(world_[sample], a, b, c);
            if (const double square = glm::dot(difference, difference); square < least) {
                least = square;
                nearest = index;
            }
        }
        moved_.push_back({sample, nearest});
        return least <= tolerance_ * tolerance_;
    };
    if (!find_face(from))
        return false;
    for (const auto& [index, face] : changed_)
        for (std::uint32_t sample = first_sample_[index]; sample != none; sample = next_sample_[sample])
            if (!find_face(sample))
                return false;

    if (!is_near_surface(measured_spacing, &Nearness<Degree>::is_near))
        return false;

    for (const auto& [index, face] : changed_)
        first_sample_[index] = none;
    for (const auto& [sample, face] : moved_) {
        next_sample_[sample] = first_sample_[face];
        first_sample_[face] = sample;
    }
    editable_.collapse(from, to);
    quadrics_[to].add(quadrics_[from]);
    ++stamps_[from];
    return true;
}

template <int Degree>
void Simplification<Degree>::run(const Progress& progress)
{
    const auto vertex_count = static_cast<std::uint32_t>(lattice_.size());
    for (std::uint32_t vertex = 0; vertex < vertex_count; ++vertex)
        push(vertex);
    for (std::size_t collapses = 0, steps = 0; !queue_.empty(); ++steps) {
        if (steps % 1024 == 0 && progress &&
            !progress(static_cast<double>(collapses) / static_cast<double>(vertex_count)))
            throw Cancelled();
        const Candidate candidate = queue_.top();
        queue_.pop();
        if (candidate.stamp != stamps_[candidate.vertex])
            continue;
        find_targets(candidate.vertex);
        const std::vector<std::uint32_t> around = neighbors_;
        const bool is_collapsed = std::any_of(targets_.begin(), targets_.end(), [&](const Target& target) {
            return try_collapse(candidate.vertex, target.vertex);
        });
        if (!is_collapsed)
            continue;
        ++collapses;
        for (const std::uint32_t vertex : around) // faces or the quadric of these have changed
            push(vertex);
    }
}

template <int Degree>
double Simplification<Degree>::finish(LabeledMesh& mesh) &&
{
    double largest = 0.0;
    for (std::uint32_t index = 0; index < first_sample_.size(); ++index)
        for (std::uint32_t sample = first_sample_[index]; sample != none; sample = next_sample_[sample]) {
            const auto [a, b, c] = corners(world_, editable_.faces()[index]);
            largest =
                std::max(largest, glm::distance(world_[sample], closest_point_of_triangle(world_[sample], a, b, c)));
        }
    std::tie(mesh.faces, mesh.labels) = std::move(editable_).take();
    drop_unused_vertices(mesh);
    return largest;
}

} // namespace

template <int Degree>
double simplify(const LatticeField<Degree>& field, LabeledMesh& mesh, double tolerance, const Progress& progress)
{
    Simplification<Degree> simplification(field, mesh, tolerance);
    simplification.run(progress);
    return std::move(simplification).finish(mesh);
}

template double simplify(const LatticeField<1>&, LabeledMesh&, double, const Progress&);
template double simplify(const LatticeField<2>&, LabeledMesh&, double, const Progress&);
template double simplify(const LatticeField<3>&, LabeledMesh&, double, const Progress&);

} // namespace isospline
