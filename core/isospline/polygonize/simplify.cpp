#include "isospline/polygonize/simplify.h"

#include "isospline/math/point_triangle.h"
#include "isospline/polygonize/face_crossing.h"
#include "isospline/polygonize/simplification.h"
#include "isospline/util/progress.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

namespace isospline {

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
        if (mean_square <= simplicity_.of_faces * simplicity_.of_faces)
            targets_.push_back({mean_square + 1e-6 * glm::dot(edge, edge), other});
    }
    std::sort(targets_.begin(), targets_.end());
}

template <int Degree>
void Simplification<Degree>::push(std::uint32_t vertex)
{
    if (is_locked(vertex))
        return;
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
bool Simplification<Degree>::is_near_surface(double spacing, bool (Nearness<Degree>::*is_near)(const glm::dvec3&,
                                                                                               FaceLabel) const) const
{
    return std::all_of(changed_.begin(), changed_.end(), [&](const auto& change) {
        const FaceLabel label = editable_.labels()[change.first];
        return !is_left(change.second) ||
               for_each_sample(corners(lattice_, change.second), spacing,
                               [&](const glm::dvec3& at) { return (nearness_.*is_near)(at, label); });
    });
}

/// Whether the faces that a collapse changes cross each other or the rest of the mesh.
template <int Degree>
bool Simplification<Degree>::crosses_others()
{
    Box around;
    for (const auto& [index, face] : changed_) {
        is_changing_[index] = 1;
        if (is_left(face))
            around.extend(box_of(face));
    }
    others_.clear();
    octree_.visit(around, [&](std::uint32_t other) {
        if (is_changing_[other] == 0)
            others_.push_back(editable_.faces()[other]);
        return true;
    });
    for (const auto& [index, face] : changed_) {
        is_changing_[index] = 0;
        if (is_left(face))
            others_.push_back(face);
    }
    return std::any_of(changed_.begin(), changed_.end(), [&](const auto& change) {
        const glm::uvec3& face = change.second;
        return is_left(face) && std::any_of(others_.begin(), others_.end(), [&](const glm::uvec3& other) {
                   return other != face && faces_cross(lattice_, face, other);
               });
    });
}

/// Gives each sample to the face that is nearest to it after a collapse; false if one is too far.
template <int Degree>
bool Simplification<Degree>::find_faces_of_samples(std::uint32_t from)
{
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
        return least <= simplicity_.of_vertices * simplicity_.of_vertices;
    };
    if (!find_face(from))
        return false;
    for (const auto& [index, face] : changed_)
        for (std::uint32_t sample = first_sample_[index]; sample != none; sample = next_sample_[sample])
            if (!find_face(sample))
                return false;
    return true;
}

template <int Degree>
bool Simplification<Degree>::try_collapse(std::uint32_t from, std::uint32_t to)
{
    // A cheap estimate at few points rules out most collapses that exceed the tolerance.
    constexpr double first_spacing = 2.0;
    if (!editable_.can_collapse(from, to) || !keeps_shape(from, to) ||
        !is_near_surface(first_spacing, &Nearness<Degree>::is_likely) || !find_faces_of_samples(from) ||
        !is_near_surface(measured_spacing, &Nearness<Degree>::is_near) || crosses_others())
        return false;
    collapse(from, to);
    return true;
}

/// After find_faces_of_samples().
template <int Degree>
void Simplification<Degree>::collapse(std::uint32_t from, std::uint32_t to)
{
    for (const auto& [index, face] : changed_) {
        first_sample_[index] = none;
        octree_.remove(index);
        if (is_left(face))
            octree_.insert(index, box_of(face));
    }
    for (const auto& [sample, face] : moved_) {
        next_sample_[sample] = first_sample_[face];
        first_sample_[face] = sample;
    }
    editable_.collapse(from, to);
    quadrics_[to].add(quadrics_[from]);
    ++stamps_[from];
    history_.push_back({from, to});
}

template <int Degree>
void Simplification<Degree>::run(const Progress& progress)
{
    const auto vertex_count = static_cast<std::uint32_t>(lattice_.size());
    for (std::uint32_t vertex = 0; vertex < vertex_count; ++vertex)
        if (is_queued_.empty() || is_queued_[vertex] != 0)
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
std::vector<Collapse> Simplification<Degree>::finish(LabeledMesh& mesh) &&
{
    std::tie(mesh.faces, mesh.labels) = std::move(editable_).take();
    return std::move(history_);
}

template <int Degree>
void simplify(const LatticeField<Degree>& field, LabeledMesh& mesh, const Simplicity& simplicity,
              std::vector<Collapse>& history, const Progress& progress)
{
    Simplification<Degree> simplification(field, mesh, simplicity);
    if (!history.empty())
        simplification.repeat(history, part_of(progress, 0.0, 0.5));
    simplification.run(history.empty() ? progress : part_of(progress, 0.5, 1.0));
    history = std::move(simplification).finish(mesh);
}

template class Simplification<1>;
template class Simplification<2>;
template class Simplification<3>;
template void simplify(const LatticeField<1>&, LabeledMesh&, const Simplicity&, std::vector<Collapse>&,
                       const Progress&);
template void simplify(const LatticeField<2>&, LabeledMesh&, const Simplicity&, std::vector<Collapse>&,
                       const Progress&);
template void simplify(const LatticeField<3>&, LabeledMesh&, const Simplicity&, std::vector<Collapse>&,
                       const Progress&);

} // namespace isospline
