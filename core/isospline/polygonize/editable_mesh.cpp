#include "isospline/polygonize/editable_mesh.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace isospline {

namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

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

std::span<const std::uint32_t> EditableMesh::faces_of(std::uint32_t vertex)
{
    found_.clear();
    std::uint32_t* link = &first_corner_[vertex];
    while (*link != none) {
        const std::uint32_t corner = *link;
        if (is_alive(corner / 3)) {
            found_.push_back(corner / 3);
            link = &next_corner_[corner];
        } else {
            *link = next_corner_[corner];
        }
    }
    return found_;
}

void EditableMesh::find_neighbors(std::uint32_t vertex, std::vector<Neighbor>& neighbors)
{
    neighbors.clear();
    for (const std::uint32_t face : faces_of(vertex))
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

bool EditableMesh::can_collapse(std::uint32_t from, std::uint32_t to)
{
    find_neighbors(from, around_from_);
    find_neighbors(to, around_to_);
    const auto edge = std::find_if(around_from_.begin(), around_from_.end(),
                                   [to](const Neighbor& neighbor) { return neighbor.vertex == to; });
    if (edge == around_from_.end())
        return false;

    const auto line_count = std::count_if(around_from_.begin(), around_from_.end(),
                                          [](const Neighbor& neighbor) { return neighbor.is_line; });
    if (line_count != 0 && (line_count != 2 || !edge->is_line))
        return false;

    // The link condition: the only common neighbours of both ends are the third corners of the edge's faces. These must
    // have more than two faces; otherwise their remaining faces would coincide.
    std::size_t common = 0;
    for (const Neighbor& neighbor : around_from_) {
        const bool is_common = std::any_of(around_to_.begin(), around_to_.end(),
                                           [&](const Neighbor& other) { return other.vertex == neighbor.vertex; });
        if (!is_common)
            continue;
        ++common;
        if (faces_of(neighbor.vertex).size() <= 3)
            return false;
    }
    const auto is_border = [](const Neighbor& neighbor) { return neighbor.face_count == 1; };
    if (edge->face_count == 1 && (around_from_.size() <= 2 || around_to_.size() <= 2))
        return false;
    if (edge->face_count == 2 && std::any_of(around_from_.begin(), around_from_.end(), is_border))
        return false;
    return common == edge->face_count;
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

} // namespace isospline
