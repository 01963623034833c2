#include "isospline/polygonize/merge_vertices.h"

#include "isospline/polygonize/editable_mesh.h"
#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

namespace isospline {

namespace {

/// Whether a collapse flips a face. Faces of nearly zero area do not count.
bool turns_over(EditableMesh& editable, const std::vector<glm::dvec3>& vertices, std::uint32_t from, std::uint32_t to,
                double distance)
{
    const double least_area = distance * distance;
    const auto faces = editable.faces_of(from);
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

void drop_unused_vertices(LabeledMesh& mesh)
{
    constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> numbers(mesh.vertices.size(), unused);
    for (const glm::uvec3& face : mesh.faces)
        for (int corner = 0; corner < 3; ++corner)
            numbers[face[corner]] = 0;
    std::uint32_t count = 0;
    for (std::size_t i = 0; i < numbers.size(); ++i)
        if (numbers[i] != unused) {
            mesh.vertices[count] = mesh.vertices[i];
            numbers[i] = count++;
        }
    mesh.vertices.resize(count);
    for (glm::uvec3& face : mesh.faces)
        face = {numbers[face.x], numbers[face.y], numbers[face.z]};
}

void merge_close_vertices(LabeledMesh& mesh, double distance)
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
    const auto try_collapse = [&](std::uint32_t from, std::uint32_t to) {
        if (!is_short(from, to) || !editable.can_collapse(from, to) ||
            turns_over(editable, mesh.vertices, from, to, distance))
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
