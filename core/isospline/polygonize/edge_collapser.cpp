#include "isospline/polygonize/edge_collapser.h"

#include "isospline/math/point_triangle.h"
#include "isospline/polygonize/face_crossing.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace isospline {

template <int Degree>
void EdgeCollapser<Degree>::insert_faces(const std::vector<std::uint32_t>& faces)
{
    Box bounds;
    for (const std::uint32_t face : faces)
        bounds.extend(box_of(mesh_.lattice, mesh_.editable.faces()[face]));
    octree_.emplace(bounds, faces.size(), 0.125);
    face_of_item_ = faces;
    for (std::uint32_t item = 0; item < faces.size(); ++item) {
        const glm::uvec3& face = mesh_.editable.faces()[faces[item]];
        octree_->insert(item, box_of(mesh_.lattice, face));
        // Faces with a vertex in another block stay as they are.
        if (mesh_.block_of[face.x] == block_ && mesh_.block_of[face.y] == block_ && mesh_.block_of[face.z] == block_)
            mesh_.item_of_face[faces[item]] = item;
    }
}

template <int Degree>
void EdgeCollapser<Degree>::find_targets(std::uint32_t vertex)
{
    neighbors_.clear();
    for (const std::uint32_t index : mesh_.editable.faces_of(vertex, workspace_))
        for (int corner = 0; corner < 3; ++corner)
            if (const std::uint32_t other = mesh_.editable.faces()[index][corner]; other != vertex)
                neighbors_.push_back(other);
    std::sort(neighbors_.begin(), neighbors_.end());
    neighbors_.erase(std::unique(neighbors_.begin(), neighbors_.end()), neighbors_.end());
    targets_.clear();
    const glm::dvec3& at = mesh_.world[vertex];
    for (const std::uint32_t other : neighbors_) {
        const double mean_square = mesh_.quadrics[vertex].mean_square(mesh_.world[other]);
        const glm::dvec3 edge = mesh_.world[other] - at;
        if (mean_square <= simplicity_.of_faces * simplicity_.of_faces)
            targets_.push_back({mean_square + 1e-6 * glm::dot(edge, edge), other});
    }
    std::sort(targets_.begin(), targets_.end());
}

template <int Degree>
void EdgeCollapser<Degree>::push(std::uint32_t vertex)
{
    if (mesh_.is_locked[vertex] != 0)
        return;
    if (mesh_.is_inner[vertex] == 0) {
        mesh_.is_queued[vertex] = 1; // for another run
        return;
    }
    find_targets(vertex);
    ++mesh_.stamps[vertex];
    if (!targets_.empty())
        queue_.push({targets_.front().cost, vertex, mesh_.stamps[vertex]});
}

/// Whether no face is flipped, or becomes much thinner.
template <int Degree>
bool EdgeCollapser<Degree>::keeps_shape(std::uint32_t from, std::uint32_t to)
{
    changed_.clear();
    for (const std::uint32_t index : mesh_.editable.faces_of(from, workspace_)) {
        const glm::uvec3 before = mesh_.editable.faces()[index];
        glm::uvec3 after = before;
        for (int corner = 0; corner < 3; ++corner)
            if (before[corner] == from)
                after[corner] = to;
        changed_.push_back({index, after});
        if (!CollapsingMesh::is_left(after))
            continue;
        const auto shape_of = [&](const glm::uvec3& face) {
            const auto [a, b, c] = CollapsingMesh::corners(mesh_.world, face);
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
bool EdgeCollapser<Degree>::is_near_surface(double spacing,
                                            bool (Nearness<Degree>::*is_near)(const glm::dvec3&, FaceLabel) const) const
{
    return std::all_of(changed_.begin(), changed_.end(), [&](const auto& change) {
        const FaceLabel label = mesh_.editable.labels()[change.first];
        return !CollapsingMesh::is_left(change.second) ||
               for_each_sample(CollapsingMesh::corners(mesh_.lattice, change.second), spacing,
                               [&](const glm::dvec3& at) { return (nearness_.*is_near)(at, label); });
    });
}

/// Whether the faces that a collapse changes cross each other or the rest of the block.
template <int Degree>
bool EdgeCollapser<Degree>::crosses_others()
{
    Box around;
    others_.clear();
    for (const auto& [index, face] : changed_) {
        mesh_.is_changing[index] = 1;
        if (CollapsingMesh::is_left(face)) {
            others_.push_back({box_of(mesh_.lattice, face), face});
            around.extend(others_.back().box);
        }
    }
    const std::size_t changed_count = others_.size();
    octree_->visit(around, [&](std::uint32_t item) {
        if (const std::uint32_t other = face_of_item_[item]; mesh_.is_changing[other] == 0)
            if (const Box box = box_of(mesh_.lattice, mesh_.editable.faces()[other]); box.meets(around))
                others_.push_back({box, mesh_.editable.faces()[other]});
        return true;
    });
    for (const auto& [index, face] : changed_)
        mesh_.is_changing[index] = 0;
    for (std::size_t i = 0; i < changed_count; ++i)
        for (std::size_t j = i + 1; j < others_.size(); ++j)
            if (others_[i].box.meets(others_[j].box) && faces_cross(mesh_.lattice, others_[i].face, others_[j].face))
                return true;
    return false;
}

/// Gives each sample to the face that is nearest to it after a collapse; false if one is too far.
template <int Degree>
bool EdgeCollapser<Degree>::find_faces_of_samples(std::uint32_t from)
{
    moved_.clear();
    const auto find_face = [&](std::uint32_t sample) {
        const glm::dvec3& at = mesh_.world[sample];
        double least = std::numeric_limits<double>::infinity();
        std::uint32_t nearest = CollapsingMesh::none;
        for (const auto& [index, face] : changed_) {
            if (!CollapsingMesh::is_left(face))
                continue;
            const auto [a, b, c] = CollapsingMesh::corners(mesh_.world, face);
            const glm::dvec3 difference = at - closest_point_of_triangle(at, a, b, c);
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
        for (std::uint32_t sample = mesh_.first_sample[index]; sample != CollapsingMesh::none;
             sample = mesh_.next_sample[sample])
            if (!find_face(sample))
                return false;
    return true;
}

template <int Degree>
bool EdgeCollapser<Degree>::try_collapse(std::uint32_t from, std::uint32_t to)
{
    // A cheap estimate at few points rules out most collapses that exceed the tolerance.
    constexpr double first_spacing = 2.0;
    if (!mesh_.editable.can_collapse(from, to, workspace_) || !keeps_shape(from, to) ||
        !is_near_surface(first_spacing, &Nearness<Degree>::is_likely) || !find_faces_of_samples(from) ||
        !is_near_surface(care_.spacing, &Nearness<Degree>::is_near) || (care_.of_crossings && crosses_others()))
        return false;
    collapse(from, to);
    return true;
}

/// After find_faces_of_samples().
template <int Degree>
void EdgeCollapser<Degree>::collapse(std::uint32_t from, std::uint32_t to)
{
    for (const auto& [index, face] : changed_) {
        mesh_.first_sample[index] = CollapsingMesh::none;
        if (octree_) {
            const std::uint32_t item = mesh_.item_of_face[index];
            octree_->remove(item);
            if (CollapsingMesh::is_left(face))
                octree_->insert(item, box_of(mesh_.lattice, face));
        }
    }
    for (const auto& [sample, face] : moved_)
        mesh_.add_sample(sample, face);
    mesh_.editable.collapse(from, to);
    mesh_.quadrics[to].add(mesh_.quadrics[from]);
    ++mesh_.stamps[from];
    done_.push_back({from, to});
}

template <int Degree>
bool EdgeCollapser<Degree>::repeat(const Collapse& repeated)
{
    const auto [from, to] = repeated;
    if (!mesh_.editable.can_collapse(from, to, workspace_) || !keeps_shape(from, to) ||
        !is_near_surface(care_.spacing, &Nearness<Degree>::is_near))
        return false;
    moved_.clear();
    collapse(from, to);
    return true;
}

template <int Degree>
std::vector<Collapse> EdgeCollapser<Degree>::run(const std::vector<std::uint32_t>& vertices,
                                                 const std::vector<std::uint32_t>& faces, const Progress& progress)
{
    if (care_.of_crossings)
        insert_faces(faces);
    for (const std::uint32_t vertex : vertices)
        push(vertex);
    for (std::size_t steps = 0; !queue_.empty(); ++steps) {
        if (steps % 1024 == 0)
            report(progress, std::min(1.0, static_cast<double>(done_.size()) / static_cast<double>(vertices.size())));
        const Candidate candidate = queue_.top();
        queue_.pop();
        if (candidate.stamp != mesh_.stamps[candidate.vertex])
            continue;
        find_targets(candidate.vertex);
        const std::vector<std::uint32_t> around = neighbors_;
        const bool is_collapsed = std::any_of(targets_.begin(), targets_.end(), [&](const Target& target) {
            return try_collapse(candidate.vertex, target.vertex);
        });
        if (is_collapsed)
            for (const std::uint32_t vertex : around) // faces or the quadric of these have changed
                push(vertex);
    }
    return std::move(done_);
}

template class EdgeCollapser<1>;
template class EdgeCollapser<2>;
template class EdgeCollapser<3>;

} // namespace isospline
