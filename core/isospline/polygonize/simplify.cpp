#include "isospline/polygonize/simplify.h"

#include "isospline/math/affine.h"
#include "isospline/math/point_triangle.h"
#include "isospline/polygonize/editable_mesh.h"
#include "isospline/polygonize/merge_vertices.h"
#include "isospline/query/closest_point.h"
#include "isospline/query/lattice_metric.h"
#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

namespace isospline {

namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// How far Newton's method may lead, in lattice units.
constexpr double search_reach = 4.0;

using Corners = std::array<glm::dvec3, 3>;

/// Calls `visit` with points of a triangle that are at most `spacing` apart along its edges, corners left out, until it
/// returns false; tells whether it never did.
template <typename Visit>
bool for_each_sample(const Corners& corners, double spacing, const Visit& visit)
{
    if (!visit((corners[0] + corners[1] + corners[2]) / 3.0))
        return false;
    const double longest = std::max({glm::distance(corners[0], corners[1]), glm::distance(corners[1], corners[2]),
                                     glm::distance(corners[2], corners[0])});
    const int steps = std::clamp(static_cast<int>(std::ceil(longest / spacing)), 1, 1024);
    for (int i = 0; i <= steps; ++i)
        for (int j = 0; i + j <= steps; ++j) {
            const int k = steps - i - j;
            if (i == steps || j == steps || k == steps)
                continue;
            const glm::dvec3 weights = glm::dvec3(i, j, k) / static_cast<double>(steps);
            if (!visit(weights.x * corners[0] + weights.y * corners[1] + weights.z * corners[2]))
                return false;
        }
    return true;
}

/// The sum of squared distances from planes, and how many of them there are, by area.
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

/// One run of simplify().
template <int Degree>
class Simplification {
public:
    Simplification(const LatticeField<Degree>& field, LabeledMesh& mesh, double tolerance)
        : field_(field), metric_(field.surface().volume().lattice_to_world()), tolerance_(tolerance),
          lattice_(mesh.vertices), editable_(lattice_.size(), std::move(mesh.faces), std::move(mesh.labels)),
          world_(lattice_.size()), quadrics_(lattice_.size()), stamps_(lattice_.size(), 0),
          next_sample_(lattice_.size(), none), first_sample_(editable_.faces().size(), none)
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
    struct Candidate {
        double cost;
        std::uint32_t from, to, stamp;

        bool operator<(const Candidate& other) const // the least cost is on top
        {
            return std::tie(cost, from, to) > std::tie(other.cost, other.from, other.to);
        }
    };

    void push(std::uint32_t from, std::uint32_t to);
    Corners corners(const std::vector<glm::dvec3>& positions, const glm::uvec3& face) const
    {
        return {positions[face.x], positions[face.y], positions[face.z]};
    }
    bool keeps_shape(std::uint32_t from, std::uint32_t to);
    bool is_near_surface(const Corners& lattice, bool by_estimate) const;
    bool try_collapse(std::uint32_t from, std::uint32_t to);

    const LatticeField<Degree>& field_;
    LatticeMetric metric_;
    double tolerance_;
    std::vector<glm::dvec3> lattice_;
    EditableMesh editable_;
    std::vector<glm::dvec3> world_; ///< but for a translation
    std::vector<Quadric> quadrics_;
    std::vector<std::uint32_t> stamps_;
    std::priority_queue<Candidate> queue_;
    // Vertices that went are a linked list at each face, that of the nearest face.
    std::vector<std::uint32_t> next_sample_, first_sample_;
    std::vector<std::pair<std::uint32_t, glm::uvec3>> changed_;  ///< faces that a collapse changes, as they become
    std::vector<std::pair<std::uint32_t, std::uint32_t>> moved_; ///< samples, and the face that each goes to
};

template <int Degree>
void Simplification<Degree>::push(std::uint32_t from, std::uint32_t to)
{
    const double mean_square = quadrics_[from].mean_square(world_[to]);
    if (mean_square > tolerance_ * tolerance_)
        return;
    const glm::dvec3 edge = world_[to] - world_[from];
    queue_.push({mean_square + 1e-6 * glm::dot(edge, edge), from, to, stamps_[from] + stamps_[to]});
}

/// Whether no face turns over, or becomes much thinner than it was.
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
        if (after.x == after.y || after.y == after.z || after.z == after.x)
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

template <int Degree>
bool Simplification<Degree>::is_near_surface(const Corners& lattice, bool by_estimate) const
{
    constexpr double spacing = 0.5;
    return for_each_sample(lattice, spacing, [&](const glm::dvec3& at) {
        if (!by_estimate) {
            const auto foot = field_.project(at, search_reach, metric_);
            return foot && metric_.length(*foot - at) <= tolerance_;
        }
        const PointInCell point(field_.surface(), at);
        const auto [value, slope] = scalar::value_and_gradient_in_cell<Degree>(point.cell, point.local);
        const glm::dvec3 gradient = glm::dvec3(slope[0], slope[1], slope[2]) * metric_.to_lattice;
        return value * value <= tolerance_ * tolerance_ * glm::dot(gradient, gradient);
    });
}

template <int Degree>
bool Simplification<Degree>::try_collapse(std::uint32_t from, std::uint32_t to)
{
    if (!editable_.can_collapse(from, to) || !keeps_shape(from, to))
        return false;
    const auto is_left = [](const glm::uvec3& face) {
        return face.x != face.y && face.y != face.z && face.z != face.x;
    };
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

    // The estimate of a distance, |f - level| over the slope, is cheap, and rules most collapses out that are too far.
    for (const bool by_estimate : {true, false})
        for (const auto& [index, face] : changed_)
            if (is_left(face) && editable_.labels()[index] == on_isosurface &&
                !is_near_surface(corners(lattice_, face), by_estimate))
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
    ++stamps_[to];
    return true;
}

template <int Degree>
void Simplification<Degree>::run(const Progress& progress)
{
    for (const glm::uvec3& face : editable_.faces())
        for (int corner = 0; corner < 3; ++corner) {
            push(face[corner], face[(corner + 1) % 3]);
            push(face[(corner + 1) % 3], face[corner]); // twice for inner edges, once for borders
        }
    const std::size_t vertex_count = lattice_.size();
    std::vector<std::uint32_t> around;
    for (std::size_t collapses = 0, steps = 0; !queue_.empty(); ++steps) {
        if (steps % 4096 == 0 && progress &&
            !progress(static_cast<double>(collapses) / static_cast<double>(vertex_count)))
            throw Cancelled();
        const Candidate candidate = queue_.top();
        queue_.pop();
        const auto [cost, from, to, stamp] = candidate;
        if (stamp != stamps_[from] + stamps_[to] || !try_collapse(from, to))
            continue;
        ++collapses;
        around.clear();
        for (const std::uint32_t index : editable_.faces_of(to))
            for (int corner = 0; corner < 3; ++corner)
                if (editable_.faces()[index][corner] != to)
                    around.push_back(editable_.faces()[index][corner]);
        std::sort(around.begin(), around.end());
        around.erase(std::unique(around.begin(), around.end()), around.end());
        for (const std::uint32_t other : around) {
            push(to, other);
            push(other, to);
        }
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
    std::move(editable_).take(mesh.faces, mesh.labels);
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

template <int Degree>
double distance_from_surface(const LatticeField<Degree>& field, const LabeledMesh& mesh, const Progress& progress)
{
    const Volume& volume = field.surface().volume();
    const LatticeMetric metric(volume.lattice_to_world());
    double largest = 0.0;
    std::mutex mutex;
    parallel_for(
        mesh.faces.size(), 1024,
        [&](std::size_t begin, std::size_t end) {
            std::unique_ptr<ClosestPointFinder> finder;
            double most = 0.0;
            for (std::size_t i = begin; i < end; ++i) {
                if (mesh.labels[i] != on_isosurface)
                    continue;
                const glm::uvec3& face = mesh.faces[i];
                for_each_sample({mesh.vertices[face.x], mesh.vertices[face.y], mesh.vertices[face.z]}, 0.25,
                                [&](const glm::dvec3& at) {
                                    if (const auto foot = field.project(at, search_reach, metric)) {
                                        most = std::max(most, metric.length(*foot - at));
                                    } else {
                                        if (!finder)
                                            finder = std::make_unique<ClosestPointFinder>(field.surface());
                                        most = std::max(
                                            most, (*finder)(transform_point(volume.lattice_to_world(), at)).distance);
                                    }
                                    return true;
                                });
            }
            const std::lock_guard lock(mutex);
            largest = std::max(largest, most);
        },
        progress);
    return largest;
}

template double simplify(const LatticeField<1>&, LabeledMesh&, double, const Progress&);
template double simplify(const LatticeField<2>&, LabeledMesh&, double, const Progress&);
template double simplify(const LatticeField<3>&, LabeledMesh&, double, const Progress&);
template double distance_from_surface(const LatticeField<1>&, const LabeledMesh&, const Progress&);
template double distance_from_surface(const LatticeField<2>&, const LabeledMesh&, const Progress&);
template double distance_from_surface(const LatticeField<3>&, const LabeledMesh&, const Progress&);

} // namespace isospline
