#include "isospline/polygonize/editable_mesh.h"

#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

namespace isospline {

namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// Whether a collapse flips a face. Faces of nearly zero area do not count.
bool turns_over(EditableMesh& editable, EditableMesh::Workspace& workspace, const std::vector<glm::dvec3>& vertices,
                std::uint32_t from, std::uint32_t to, double distance)
{
    const double least_area = distance * distance;
    const auto faces = editable.faces_of(from, workspace);
    return std::any_of(faces.begin(), faces.end(), [&](std::uint32_t index) {
        const glm::uvec3 face = editable.faces()[index];
        if (face.x == to || face.y == to || face.z == to)
            return false;
        const auto area_of = [&](bool moved) {
            glm::dvec3 corners[3];
            for (int corner = 0; corner < 3; ++corner)
                corners[corner] = vertices[moved && face[corner] == from ? to : face[corner]];
            return glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
        };
        const glm::dvec3 before = area_of(false), after = area_of(true);
        return glm::length(before) > least_area && glm::dot(before, after) <= 0.0;
    });
}

} // namespace

EditableMesh::EditableMesh(std::size_t vertex_count, std::vector<glm::uvec3> faces, std::vector<FaceLabel> labels)
    : faces_(std::move(faces)), labels_(std::move(labels)), first_corner_(vertex_count, none),
      next_corner_(3 * faces_.size(), none)
{
    for (std::size_t face = faces_.size(); face-- > 0;)
        for (int corner = 3; corner-- > 0;) {
            const std::uint32_t vertex = faces_[face][corner];
            const auto at = static_cast<std::uint32_t>(3 * face) + static_cast<std::uint32_t>(corner);
            next_corner_[at] = first_corner_[vertex];
            first_corner_[vertex] = at;
        }
}

std::span<const std::uint32_t> EditableMesh::faces_of(std::uint32_t vertex, Workspace& workspace)
{
    std::vector<std::uint32_t>& found = workspace.faces;
    found.clear();
    std::uint32_t* link = &first_corner_[vertex];
    while (*link != none) {
        const std::uint32_t corner = *link;
        if (is_alive(corner / 3)) {
            found.push_back(corner / 3);
            link = &next_corner_[corner];
        } else {
            *link = next_corner_[corner];
        }
    }
    return found;
}

void EditableMesh::find_neighbors(std::uint32_t vertex, std::vector<Neighbor>& neighbors, Workspace& workspace)
{
    neighbors.clear();
    for (const std::uint32_t face : faces_of(vertex, workspace))
        for (int corner = 0; corner < 3; ++corner) {
            const std::uint32_t other = faces_[face][corner];
            if (other == vertex)
                continue;
            const auto known = std::find_if(neighbors.begin(), neighbors.end(),
                                            [other](const Neighbor& neighbor) { return neighbor.vertex == other; });
            if (known == neighbors.end()) {
                neighbors.push_back({other, 1, labels_[face], true});
            } else {
                ++known->face_count;
                known->is_line = known->label != labels_[face];
            }
        }
}

/// Whether a collapse, after find_neighbors() of both ends, makes an edge of the isosurface between vertices at one
/// cap.
bool EditableMesh::makes_chord(std::uint32_t to, Workspace& workspace)
{
    const auto is_on_cap = [&](std::uint32_t face) { return labels_[face] != on_isosurface; };
    std::vector<FaceLabel>& caps = workspace.caps;
    caps.clear();
    for (const std::uint32_t face : faces_of(to, workspace))
        if (is_on_cap(face))
            caps.push_back(labels_[face]);
    if (caps.empty())
        return false;
    for (const Neighbor& neighbor : workspace.around_from) {
        const bool is_known = neighbor.vertex == to ||
                              std::any_of(workspace.around_to.begin(), workspace.around_to.end(),
                                          [&](const Neighbor& other) { return other.vertex == neighbor.vertex; });
        if (is_known || neighbor.is_line || neighbor.label != on_isosurface)
            continue;
        const auto faces = faces_of(neighbor.vertex, workspace);
        if (std::any_of(faces.begin(), faces.end(), [&](std::uint32_t face) {
                return std::find(caps.begin(), caps.end(), labels_[face]) != caps.end();
            }))
            return true;
    }
    return false;
}

bool EditableMesh::can_collapse(std::uint32_t from, std::uint32_t to, Workspace& workspace)
{
    std::vector<Neighbor>&around_from = workspace.around_from, &around_to = workspace.around_to;
    find_neighbors(from, around_from, workspace);
    find_neighbors(to, around_to, workspace);
    const auto edge = std::find_if(around_from.begin(), around_from.end(),
                                   [to](const Neighbor& neighbor) { return neighbor.vertex == to; });
    if (edge == around_from.end())
        return false;

    const auto line_count = std::count_if(around_from.begin(), around_from.end(),
                                          [](const Neighbor& neighbor) { return neighbor.is_line; });
    if (line_count != 0 && (line_count != 2 || !edge->is_line))
        return false;

    // The link condition: the only common neighbours of both ends are the third corners of the edge's faces. These must
    // have more than two faces; otherwise their remaining faces would coincide.
    std::size_t common = 0;
    for (const Neighbor& neighbor : around_from) {
        const bool is_common = std::any_of(around_to.begin(), around_to.end(),
                                           [&](const Neighbor& other) { return other.vertex == neighbor.vertex; });
        if (!is_common)
            continue;
        ++common;
        if (faces_of(neighbor.vertex, workspace).size() <= 3)
            return false;
    }
    const auto is_border = [](const Neighbor& neighbor) { return neighbor.face_count == 1; };
    if (edge->face_count == 1 && (around_from.size() <= 2 || around_to.size() <= 2))
        return false;
    if (edge->face_count == 2 && std::any_of(around_from.begin(), around_from.end(), is_border))
        return false;
    return common == edge->face_count && !makes_chord(to, workspace);
}

void EditableMesh::collapse(std::uint32_t from, std::uint32_t to)
{
    std::uint32_t corner = first_corner_[from];
    while (corner != none) {
        const std::uint32_t next = next_corner_[corner];
        glm::uvec3& face = faces_[corner / 3];
        if (face.x != face.y) {
            if (face.x == to || face.y == to || face.z == to) {
                face = glm::uvec3(to);
            } else {
                face[static_cast<int>(corner % 3)] = to;
                next_corner_[corner] = first_corner_[to];
                first_corner_[to] = corner;
            }
        }
        corner = next;
    }
    first_corner_[from] = none;
}

std::pair<std::vector<glm::uvec3>, std::vector<FaceLabel>> EditableMesh::take() &&
{
    std::size_t kept = 0;
    for (std::size_t face = 0; face < faces_.size(); ++face)
        if (is_alive(static_cast<std::uint32_t>(face))) {
            faces_[kept] = faces_[face];
            labels_[kept++] = labels_[face];
        }
    faces_.resize(kept);
    labels_.resize(kept);
    return {std::move(faces_), std::move(labels_)};
}

std::vector<std::uint32_t> drop_unused_vertices(LabeledMesh& mesh)
{
    constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> numbers(mesh.vertices.size(), unused);
    for (const glm::uvec3& face : mesh.faces)
        for (int corner = 0; corner < 3; ++corner)
            numbers[face[corner]] = 0;
    std::vector<std::uint32_t> kept;
    for (std::uint32_t i = 0; i < numbers.size(); ++i)
        if (numbers[i] != unused) {
            numbers[i] = static_cast<std::uint32_t>(kept.size());
            mesh.vertices[numbers[i]] = mesh.vertices[i];
            kept.push_back(i);
        }
    mesh.vertices.resize(kept.size());
    for (glm::uvec3& face : mesh.faces)
        face = {numbers[face.x], numbers[face.y], numbers[face.z]};
    return kept;
}

void merge_close_vertices(LabeledMesh& mesh, double distance, const std::function<bool(const glm::dvec3&)>& stays)
{
    const auto is_short = [&](std::uint32_t a, std::uint32_t b) {
        return glm::distance(mesh.vertices[a], mesh.vertices[b]) < distance;
    };
    constexpr std::size_t chunk_size = 16384;
    std::vector<std::vector<std::uint32_t>> found((mesh.faces.size() + chunk_size - 1) / chunk_size);
    parallel_for(found.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t chunk = begin; chunk < end; ++chunk)
            for (std::size_t i = chunk * chunk_size; i < std::min((chunk + 1) * chunk_size, mesh.faces.size()); ++i) {
                const glm::uvec3& face = mesh.faces[i];
                if (is_short(face.x, face.y) || is_short(face.y, face.z) || is_short(face.z, face.x))
                    found[chunk].push_back(static_cast<std::uint32_t>(i));
            }
    });
    if (std::all_of(found.begin(), found.end(), [](const auto& chunk) { return chunk.empty(); }))
        return;

    EditableMesh editable(mesh.vertices.size(), std::move(mesh.faces), std::move(mesh.labels));
    EditableMesh::Workspace workspace;
    const auto try_collapse = [&](std::uint32_t from, std::uint32_t to) {
        if (!is_short(from, to) || (stays && stays(mesh.vertices[from])) ||
            !editable.can_collapse(from, to, workspace) ||
            turns_over(editable, workspace, mesh.vertices, from, to, distance))
            return false;
        editable.collapse(from, to);
        return true;
    };
    for (const std::vector<std::uint32_t>& chunk : found)
        for (const std::uint32_t index : chunk)
            for (int corner = 0; corner < 3 && editable.is_alive(index); ++corner) {
                const glm::uvec3 face = editable.faces()[index];
                const std::uint32_t a = face[corner], b = face[(corner + 1) % 3];
                if (!try_collapse(a, b))
                    try_collapse(b, a);
            }
    std::tie(mesh.faces, mesh.labels) = std::move(editable).take();
    drop_unused_vertices(mesh);
}

} // namespace isospline
