#include "isospline/polygonize/mesh_part.h"

#include "isospline/util/check.h"
#include "isospline/util/parallel.h"
#include "isospline/util/tbb_tasks.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cstddef>
#include <limits>

namespace isospline {

namespace {

/// A vertex that other parts may share.
struct SharedVertex {
    CrossingKey key;
    std::uint32_t part, vertex;

    bool operator<(const SharedVertex& other) const { return key != other.key ? key < other.key : part < other.part; }
};

constexpr std::uint32_t unnumbered = std::numeric_limits<std::uint32_t>::max();

/// A number of 64 bits for an index (the finalizer of G. Steele, D. Lea, C. Flood, "Fast splittable pseudorandom number
/// generators", OOPSLA 2014).
std::uint64_t mixed(std::uint64_t index)
{
    index = (index + 1) * 0x9e3779b97f4a7c15u;
    index = (index ^ index >> 30) * 0xbf58476d1ce4e5b9u;
    index = (index ^ index >> 27) * 0x94d049bb133111ebu;
    return index ^ index >> 31;
}

} // namespace

std::vector<std::uint8_t> vertices_at_borders(const LabeledMesh& mesh)
{
    std::vector<std::uint64_t> balance(mesh.vertices.size(), 0), number(mesh.vertices.size());
    for (std::size_t i = 0; i < number.size(); ++i)
        number[i] = mixed(i);
    for (const glm::uvec3& face : mesh.faces) {
        balance[face.x] += number[face.y] - number[face.z];
        balance[face.y] += number[face.z] - number[face.x];
        balance[face.z] += number[face.x] - number[face.y];
    }
    std::vector<std::uint8_t> flags(balance.size());
    std::transform(balance.begin(), balance.end(), flags.begin(), [](std::uint64_t sum) { return sum != 0; });
    return flags;
}

LabeledMesh join_parts(std::vector<MeshPart> parts, const Progress& progress)
{
    std::vector<SharedVertex> shared;
    std::size_t vertex_count = 0, face_count = 0;
    for (std::size_t part = 0; part < parts.size(); ++part) {
        for (std::size_t vertex = 0; vertex < parts[part].keys.size(); ++vertex)
            if (parts[part].keys[vertex] != no_key)
                shared.push_back(
                    {parts[part].keys[vertex], static_cast<std::uint32_t>(part), static_cast<std::uint32_t>(vertex)});
        vertex_count += parts[part].vertices.size();
        face_count += parts[part].faces.size();
    }
    run_tbb_tasks([&] { tbb::parallel_sort(shared.begin(), shared.end()); });

    // Of vertices with the same key, the first part's is kept.
    std::vector<std::vector<std::uint32_t>> numbers(parts.size());
    for (std::size_t part = 0; part < parts.size(); ++part)
        numbers[part].assign(parts[part].vertices.size(), 0);
    for (std::size_t i = 1; i < shared.size(); ++i)
        if (shared[i].key == shared[i - 1].key) {
            numbers[shared[i].part][shared[i].vertex] = unnumbered;
            --vertex_count;
        }
    check_count("vertices", vertex_count);
    check_count("faces", face_count);

    LabeledMesh mesh;
    mesh.vertices.reserve(vertex_count);
    std::vector<std::size_t> first_faces(parts.size());
    std::size_t first_face = 0;
    for (std::size_t part = 0; part < parts.size(); ++part) {
        for (std::size_t vertex = 0; vertex < numbers[part].size(); ++vertex)
            if (numbers[part][vertex] != unnumbered) {
                numbers[part][vertex] = static_cast<std::uint32_t>(mesh.vertices.size());
                mesh.vertices.push_back(parts[part].vertices[vertex]);
            }
        first_faces[part] = first_face;
        first_face += parts[part].faces.size();
    }
    for (std::size_t i = 1; i < shared.size(); ++i)
        if (shared[i].key == shared[i - 1].key)
            numbers[shared[i].part][shared[i].vertex] = numbers[shared[i - 1].part][shared[i - 1].vertex];

    mesh.faces.resize(face_count);
    mesh.labels.assign(face_count, on_isosurface);
    parallel_for(
        parts.size(), 64,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t part = begin; part < end; ++part) {
                const std::vector<std::uint32_t>& number = numbers[part];
                std::transform(
                    parts[part].faces.begin(), parts[part].faces.end(),
                    mesh.faces.begin() + static_cast<std::ptrdiff_t>(first_faces[part]),
                    [&](const glm::uvec3& face) { return glm::uvec3(number[face.x], number[face.y], number[face.z]); });
                std::copy(parts[part].labels.begin(), parts[part].labels.end(),
                          mesh.labels.begin() + static_cast<std::ptrdiff_t>(first_faces[part]));
                parts[part] = {};
            }
        },
        progress);
    return mesh;
}

} // namespace isospline
