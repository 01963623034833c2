#include "isospline/polygonize/face_crossing.h"

#include "isospline/math/orientation.h"
#include "isospline/polygonize/face_octree.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace isospline {

namespace {

bool segments_meet(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c, const glm::dvec2& d)
{
    const glm::dvec2 from = glm::max(glm::min(a, b), glm::min(c, d)), to = glm::min(glm::max(a, b), glm::max(c, d));
    return from.x <= to.x && from.y <= to.y && orientation(a, b, c) * orientation(a, b, d) <= 0 &&
           orientation(c, d, a) * orientation(c, d, b) <= 0;
}

/// For a segment in the plane of a triangle.
bool meet_in_plane(const glm::dvec3& begin, const glm::dvec3& end, const Corners& triangle)
{
    // Drop a coordinate in which the triangle has area.
    for (int axis = 0; axis < 3; ++axis) {
        const auto flat = [axis](const glm::dvec3& p) { return glm::dvec2(p[(axis + 1) % 3], p[(axis + 2) % 3]); };
        const glm::dvec2 a = flat(triangle[0]), b = flat(triangle[1]), c = flat(triangle[2]);
        const int turn = orientation(a, b, c);
        if (turn == 0)
            continue;
        const glm::dvec2 p = flat(begin), q = flat(end);
        const auto contains = [&](const glm::dvec2& at) {
            return turn * orientation(a, b, at) >= 0 && turn * orientation(b, c, at) >= 0 &&
                   turn * orientation(c, a, at) >= 0;
        };
        return contains(p) || contains(q) || segments_meet(p, q, a, b) || segments_meet(p, q, b, c) ||
               segments_meet(p, q, c, a);
    }
    return false;
}

bool meets(const glm::dvec3& begin, const glm::dvec3& end, const Corners& triangle)
{
    const auto& [a, b, c] = triangle;
    const int of_begin = orientation(a, b, c, begin), of_end = orientation(a, b, c, end);
    if (of_begin * of_end > 0)
        return false;
    if (of_begin == 0 && of_end == 0)
        return meet_in_plane(begin, end, triangle);
    const int ab = orientation(begin, end, a, b), bc = orientation(begin, end, b, c),
              ca = orientation(begin, end, c, a);
    return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

/// Whether an edge of `first` without a common vertex meets `second`.
bool edges_meet(const glm::uvec3& face, const Corners& first, const glm::uvec3& other, const Corners& second)
{
    const auto is_common = [&other](std::uint32_t vertex) {
        return vertex == other.x || vertex == other.y || vertex == other.z;
    };
    for (int corner = 0; corner < 3; ++corner) {
        const int next = (corner + 1) % 3;
        if (!is_common(face[corner]) && !is_common(face[next]) &&
            meets(first[static_cast<std::size_t>(corner)], first[static_cast<std::size_t>(next)], second))
            return true;
    }
    return false;
}

} // namespace

bool faces_cross(const std::vector<glm::dvec3>& vertices, const glm::uvec3& first, const glm::uvec3& second)
{
    const Corners of_first = corners_of(vertices, first), of_second = corners_of(vertices, second);
    if (!box_of(of_first).meets(box_of(of_second)))
        return false;
    int common = 0, apex = 0, other_apex = 0;
    for (int corner = 0; corner < 3; ++corner) {
        const auto is_in = [](std::uint32_t vertex, const glm::uvec3& face) {
            return vertex == face.x || vertex == face.y || vertex == face.z;
        };
        if (is_in(first[corner], second))
            ++common;
        else
            apex = corner;
        if (!is_in(second[corner], first))
            other_apex = corner;
    }
    if (common < 2)
        return edges_meet(first, of_first, second, of_second) || edges_meet(second, of_second, first, of_first);
    if (common == 3)
        return true;
    // Two faces at an edge overlap if they are in one plane and on the same side of the edge.
    const glm::dvec3 &a = of_first[static_cast<std::size_t>((apex + 1) % 3)],
                     &b = of_first[static_cast<std::size_t>((apex + 2) % 3)];
    const glm::dvec3 &c = of_first[static_cast<std::size_t>(apex)],
                     &d = of_second[static_cast<std::size_t>(other_apex)];
    if (orientation(a, b, c, d) != 0)
        return false;
    for (int axis = 0; axis < 3; ++axis) {
        const auto flat = [axis](const glm::dvec3& p) { return glm::dvec2(p[(axis + 1) % 3], p[(axis + 2) % 3]); };
        const int sides = orientation(flat(a), flat(b), flat(c)) * orientation(flat(a), flat(b), flat(d));
        if (sides != 0)
            return sides > 0;
    }
    return false;
}

std::vector<std::array<std::uint32_t, 2>> find_crossings(const std::vector<glm::dvec3>& vertices,
                                                         const std::vector<glm::uvec3>& faces,
                                                         const std::vector<std::uint8_t>& is_examined,
                                                         const Progress& progress, const RoundedVertices* rounded)
{
    Box bounds;
    for (const glm::dvec3& vertex : vertices)
        bounds.extend(vertex);
    double sum = 0.0;
    for (const glm::uvec3& face : faces) {
        const glm::dvec3 size = box_of(vertices, face).size();
        sum += std::max({size.x, size.y, size.z});
    }
    if (!(sum > 0.0))
        return {};
    FaceOctree octree(bounds, faces.size(), 0.25 * sum / static_cast<double>(faces.size()));
    for (std::size_t i = 0; i < faces.size(); ++i)
        octree.insert(static_cast<std::uint32_t>(i), box_of(vertices, faces[i]));
    constexpr std::size_t chunk_size = 4096;
    std::vector<std::vector<std::array<std::uint32_t, 2>>> found((faces.size() + chunk_size - 1) / chunk_size);
    const auto is_chosen = [&](std::uint32_t face) { return is_examined.empty() || is_examined[face] != 0; };
    const auto examine = [&](std::uint32_t face, std::vector<std::array<std::uint32_t, 2>>& pairs) {
        if (!is_chosen(face))
            return;
        Box box = box_of(vertices, faces[face]);
        if (rounded != nullptr)
            box = {box.lower - 2.0 * rounded->error, box.upper + 2.0 * rounded->error};
        octree.visit(box, [&](std::uint32_t other) {
            if ((other > face || (other < face && !is_chosen(other))) &&
                (faces_cross(vertices, faces[face], faces[other]) ||
                 (rounded != nullptr && faces_cross(rounded->vertices, faces[face], faces[other]))))
                pairs.push_back({std::min(face, other), std::max(face, other)});
            return true;
        });
    };
    parallel_for(
        found.size(), 1,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t chunk = begin; chunk < end; ++chunk)
                for (std::size_t i = chunk * chunk_size; i < std::min((chunk + 1) * chunk_size, faces.size()); ++i)
                    examine(static_cast<std::uint32_t>(i), found[chunk]);
        },
        progress);
    std::vector<std::array<std::uint32_t, 2>> all;
    for (const auto& of_chunk : found)
        all.insert(all.end(), of_chunk.begin(), of_chunk.end());
    std::sort(all.begin(), all.end());
    return all;
}

} // namespace isospline
