#include "isospline/polygonize/simplification.h"

#include "isospline/math/point_triangle.h"
#include "isospline/polygonize/covering.h"
#include "isospline/polygonize/face_octree.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>
#include <utility>

namespace isospline {

namespace {

/// The edge of a block, in cells.
constexpr double block_edge = 32.0;
/// Progress is reported once in this number of collapses.
constexpr std::size_t report_interval = 1024;
/// The spacing of measured points in the first run, in cells.
constexpr double usual_spacing = 0.5;

/// Collapses of a vertex are done again; with surrounding_changes, also all that depend on them.
constexpr std::uint8_t changes = 1, surrounding_changes = 2;
/// The part of the tolerance within which vertices change, by how often the proof has failed there before.
constexpr double margins[] = {0.5, 0.5, 1.0, 4.0};
/// A face of the first mesh is in one cell, so its vertices are within this of all its points, along each axis.
constexpr double largest_edge = 1.0;
/// After this number of failures, all collapses that depend on those of these vertices are done again.
constexpr std::size_t failures_before_surrounding = 1;
/// After this number of failures, the vertices stay.
constexpr std::size_t failures_before_locked = 2;

} // namespace

template <int Degree>
Simplification<Degree>::Simplification(const LatticeField<Degree>& field, const SurfaceParts& parts,
                                       const LabeledMesh& fine, const Simplicity& simplicity)
    : field_(field), parts_(parts), metric_(field.surface().volume().lattice_to_world()), fine_(fine),
      simplicity_(simplicity), world_(fine.vertices.size()), is_locked_(fine.vertices.size(), 0)
{
    std::transform(fine.vertices.begin(), fine.vertices.end(), world_.begin(),
                   [this](const glm::dvec3& vertex) { return metric_.to_world * vertex; });
}

template <int Degree>
void Simplification<Degree>::run(const Progress& progress)
{
    history_.clear();
    state_.emplace(fine_, world_, is_locked_);
    run_blocks({usual_spacing, false}, progress);
}

template <int Degree>
void Simplification<Degree>::redo(const std::vector<Box>& boxes, std::uint8_t least_failures,
                                  const std::vector<Box>& samples, const Progress& progress)
{
    choose_changes(boxes, least_failures);
    for (const Box& box : samples)
        world_.push_back(metric_.to_world * box.center());
    state_.emplace(fine_, world_, is_locked_);
    repeat(part_of(progress, 0.0, 0.1));
    assign_samples(part_of(progress, 0.1, 0.2));
    run_blocks({measured_spacing, true}, part_of(progress, 0.2, 1.0));
}

template <int Degree>
std::pair<LabeledMesh, std::vector<std::uint8_t>> Simplification<Degree>::mesh() const
{
    LabeledMesh mesh{fine_.vertices, {}, {}};
    std::vector<std::uint8_t> has_changed;
    for (std::uint32_t face = 0; face < fine_.faces.size(); ++face)
        if (state_->editable.is_alive(face)) {
            mesh.faces.push_back(state_->editable.faces()[face]);
            mesh.labels.push_back(state_->editable.labels()[face]);
            has_changed.push_back(mesh.faces.back() != fine_.faces[face]);
        }
    return {std::move(mesh), std::move(has_changed)};
}

/// Chooses what is done again, by how often the proof has failed near each box.
template <int Degree>
void Simplification<Degree>::choose_changes(const std::vector<Box>& boxes, std::uint8_t least_failures)
{
    const double tolerance = simplicity_.of_faces / metric_.shortest_edge;
    const FaceOctree octree = octree_of(failed_, 0.25 * tolerance);
    std::vector<std::uint8_t> failures; // before
    for (const Box& box : boxes) {
        std::uint8_t most = least_failures;
        const Box around{box.lower - tolerance, box.upper + tolerance};
        octree.visit(around, [&](std::uint32_t earlier) {
            if (failed_[earlier].meets(around))
                most = std::max<std::uint8_t>(most, failures_[earlier] + 1);
            return true;
        });
        failures.push_back(std::min<std::uint8_t>(most, std::size(margins) - 1));
    }
    failed_.insert(failed_.end(), boxes.begin(), boxes.end());
    failures_.insert(failures_.end(), failures.begin(), failures.end());

    std::vector<Box> reaches;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        // At last, the vertices of a face are reached, however small the tolerance is.
        const double least = failures[i] + 1 == std::size(margins) ? largest_edge : 0.0;
        const double margin = std::max(margins[failures[i]] * tolerance, least);
        reaches.push_back({boxes[i].lower - margin, boxes[i].upper + margin});
    }
    const FaceOctree octree_of_reaches = octree_of(reaches, 0.25 * tolerance);
    change_.assign(fine_.vertices.size(), 0);
    parallel_for(change_.size(), 16384, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Box at{fine_.vertices[i], fine_.vertices[i]};
            octree_of_reaches.visit(at, [&](std::uint32_t box) {
                if (reaches[box].meets(at)) {
                    change_[i] = std::max(change_[i],
                                          failures[box] >= failures_before_surrounding ? surrounding_changes : changes);
                    is_locked_[i] |= failures[box] >= failures_before_locked;
                }
                return true;
            });
        }
    });
}

/// Repeats the collapses that were done, but those of vertices that are done again, which are queued. Where a collapse
/// is left out, the mesh around becomes a different one. Elsewhere, the mesh is as it was when a collapse was found to
/// be possible.
template <int Degree>
void Simplification<Degree>::repeat(const Progress& progress)
{
    std::vector<Collapse> repeated;
    std::vector<std::uint8_t>& is_queued = state_->is_queued;
    std::transform(change_.begin(), change_.end(), is_queued.begin(), [](std::uint8_t change) { return change != 0; });
    EditableMesh::Workspace workspace;
    EdgeCollapser<Degree> collapser(field_, parts_, metric_, simplicity_, *state_, 0, {usual_spacing, false});
    for (std::size_t step = 0; step < history_.size(); ++step) {
        if (step % report_interval == 0)
            report(progress, static_cast<double>(step) / static_cast<double>(history_.size()));
        const Collapse& collapse = history_[step];
        const auto faces = state_->editable.faces_of(collapse.from, workspace);
        std::uint8_t most = 0;
        for (const std::uint32_t index : faces)
            for (int corner = 0; corner < 3; ++corner)
                most = std::max(most, change_[state_->editable.faces()[index][corner]]);
        if (most == 0) {
            state_->editable.collapse(collapse.from, collapse.to);
            state_->quadrics[collapse.to].add(state_->quadrics[collapse.from]);
            repeated.push_back(collapse);
            continue;
        }
        for (const std::uint32_t index : faces)
            for (int corner = 0; corner < 3; ++corner)
                change_[state_->editable.faces()[index][corner]] = most;
        if (most == changes && is_queued[collapse.from] == 0 && collapser.repeat(collapse))
            repeated.push_back(collapse);
        else
            is_queued[collapse.from] = 1;
    }
    history_ = std::move(repeated);
    for (std::size_t i = 0; i < change_.size(); ++i)
        is_queued[i] |= change_[i] == surrounding_changes;
}

/// Gives samples to faces that are near to them: removed vertices around queued ones, and all other samples.
template <int Degree>
void Simplification<Degree>::assign_samples(const Progress& progress)
{
    const std::vector<glm::uvec3>& faces = state_->editable.faces();
    const auto vertex_count = static_cast<std::uint32_t>(fine_.vertices.size());
    std::vector<std::uint8_t> is_near_queued = state_->is_queued;
    Box bounds;
    for (std::uint32_t face = 0; face < faces.size(); ++face)
        if (state_->editable.is_alive(face))
            for (int corner = 0; corner < 3; ++corner) {
                bounds.extend(fine_.vertices[faces[face][corner]]);
                if (state_->is_queued[faces[face][corner]] != 0)
                    for (int other = 0; other < 3; ++other)
                        is_near_queued[faces[face][other]] = 1;
            }
    FaceOctree octree(bounds, faces.size(), 0.125);
    for (std::uint32_t face = 0; face < faces.size(); ++face)
        if (state_->editable.is_alive(face))
            octree.insert(face, box_of(fine_.vertices, faces[face]));
    // The vertex onto which each removed one was moved at last.
    std::vector<std::uint32_t> moved_onto(world_.size(), CollapsingMesh::none), samples;
    for (std::size_t left = history_.size(); left-- > 0;) {
        const auto [from, to] = history_[left];
        moved_onto[from] = moved_onto[to] == CollapsingMesh::none ? to : moved_onto[to];
        if (is_near_queued[moved_onto[from]] != 0)
            samples.push_back(from);
    }
    for (std::uint32_t sample = vertex_count; sample < world_.size(); ++sample)
        samples.push_back(sample);
    EditableMesh::Workspace workspace;
    for (const std::uint32_t sample : samples) // afterwards, faces_of() changes nothing
        if (moved_onto[sample] != CollapsingMesh::none)
            state_->editable.faces_of(moved_onto[sample], workspace);
    const auto nearest_face = [&](std::uint32_t sample, EditableMesh::Workspace& of_thread) {
        const glm::dvec3 &world = world_[sample], lattice = metric_.to_lattice * world;
        std::uint32_t nearest = CollapsingMesh::none;
        double least = std::numeric_limits<double>::infinity();
        const auto examine = [&](std::uint32_t face) {
            const auto [a, b, c] = CollapsingMesh::corners(world_, faces[face]);
            const glm::dvec3 difference = world - closest_point_of_triangle(world, a, b, c);
            if (const double square = glm::dot(difference, difference); square < least) {
                least = square;
                nearest = face;
            }
        };
        if (moved_onto[sample] != CollapsingMesh::none)
            for (const std::uint32_t face : state_->editable.faces_of(moved_onto[sample], of_thread))
                examine(face);
        // Most samples are much nearer to a face than they have to be, and most of these to one of those.
        for (const double distance : {0.25 * simplicity_.of_vertices, simplicity_.of_vertices}) {
            if (least <= distance * distance)
                break;
            const glm::dvec3 reach = box_of_ball(metric_, distance);
            const Box around{lattice - reach, lattice + reach};
            octree.visit(around, [&](std::uint32_t face) {
                if (box_of(fine_.vertices, faces[face]).meets(around))
                    examine(face);
                return true;
            });
        }
        return nearest;
    };
    std::vector<std::uint32_t> nearest(samples.size());
    parallel_for(
        samples.size(), report_interval,
        [&](std::size_t begin, std::size_t end) {
            EditableMesh::Workspace of_thread;
            for (std::size_t i = begin; i < end; ++i)
                nearest[i] = nearest_face(samples[i], of_thread);
        },
        progress);
    for (std::size_t i = 0; i < samples.size(); ++i)
        if (nearest[i] != CollapsingMesh::none)
            state_->add_sample(samples[i], nearest[i]);
}

/// Runs in blocks, in blocks that are moved by half of their edge, and in the whole mesh.
template <int Degree>
void Simplification<Degree>::run_blocks(const Care& care, const Progress& progress)
{
    divide(0.0);
    run_divided(care, part_of(progress, 0.0, 0.8));
    divide(0.5);
    run_divided(care, part_of(progress, 0.8, 0.95));
    divide(std::nullopt);
    run_divided(care, part_of(progress, 0.95, 1.0));
}

/// Divides the vertices into blocks that begin at a part of a block's edge, or makes all one block.
template <int Degree>
void Simplification<Degree>::divide(std::optional<double> offset)
{
    const std::vector<glm::dvec3>& vertices = fine_.vertices;
    if (!offset) {
        block_count_ = 1;
        std::fill(state_->block_of.begin(), state_->block_of.end(), 0);
        std::fill(state_->is_inner.begin(), state_->is_inner.end(), 1);
        return;
    }
    const glm::uvec3 shape = glm::uvec3(glm::dvec3(field_.surface().volume().cell_shape()) / block_edge + 2.0);
    block_count_ = shape.x * shape.y * shape.z;
    parallel_for(vertices.size(), 16384, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const glm::uvec3 at = glm::min(glm::uvec3(vertices[i] / block_edge + *offset), shape - 1u);
            state_->block_of[i] = at.x + shape.x * (at.y + shape.y * at.z);
        }
    });
    std::fill(state_->is_inner.begin(), state_->is_inner.end(), 1);
    for (const glm::uvec3& face : state_->editable.faces()) {
        const std::uint32_t block = state_->block_of[face.x];
        if (state_->block_of[face.y] != block || state_->block_of[face.z] != block)
            for (int corner = 0; corner < 3; ++corner)
                state_->is_inner[face[corner]] = 0;
    }
}

template <int Degree>
void Simplification<Degree>::run_divided(const Care& care, const Progress& progress)
{
    std::vector<std::vector<std::uint32_t>> vertices(block_count_), faces(block_count_);
    std::vector<std::uint8_t>& is_queued = state_->is_queued;
    for (std::uint32_t vertex = 0; vertex < is_queued.size(); ++vertex)
        if (is_queued[vertex] != 0 && state_->is_inner[vertex] != 0) {
            is_queued[vertex] = 0;
            vertices[state_->block_of[vertex]].push_back(vertex);
        }
    if (care.of_crossings)
        for (std::uint32_t face = 0; face < fine_.faces.size(); ++face)
            if (state_->editable.is_alive(face)) {
                const glm::uvec3& corners = state_->editable.faces()[face];
                const std::uint32_t a = state_->block_of[corners.x], b = state_->block_of[corners.y],
                                    c = state_->block_of[corners.z];
                faces[a].push_back(face);
                if (b != a)
                    faces[b].push_back(face);
                if (c != a && c != b)
                    faces[c].push_back(face);
            }
    std::vector<std::uint32_t> blocks;
    for (std::uint32_t block = 0; block < block_count_; ++block)
        if (!vertices[block].empty())
            blocks.push_back(block);
    std::vector<std::vector<Collapse>> done(blocks.size());
    parallel_for(
        blocks.size(), 1,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                EdgeCollapser<Degree> collapser(field_, parts_, metric_, simplicity_, *state_, blocks[i], care);
                done[i] =
                    collapser.run(vertices[blocks[i]], faces[blocks[i]], block_count_ == 1 ? progress : Progress());
            }
        },
        progress);
    for (const std::vector<Collapse>& of_block : done)
        history_.insert(history_.end(), of_block.begin(), of_block.end());
}

template class Simplification<1>;
template class Simplification<2>;
template class Simplification<3>;

} // namespace isospline
