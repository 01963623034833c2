// A mesh whose edges are collapsed, with what decides about collapses.
#pragma once

#include "isospline/polygonize/editable_mesh.h"
#include "isospline/polygonize/mesh_part.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace isospline {

/// The sum of squared distances from planes, weighted by area, and the sum of the weights.
struct Quadric {
    glm::dvec3 squares{0.0}, products{0.0}; ///< of the normals' coordinates: xx, yy, zz; xy, yz, zx
    glm::dvec3 b{0.0};
    double c = 0.0, weight = 0.0;

    void add_plane(const glm::dvec3& normal, double offset, double area)
    {
        squares += area * normal * normal;
        products += area * normal * glm::dvec3(normal.y, normal.z, normal.x);
        b -= area * offset * normal;
        c += area * offset * offset;
        weight += area;
    }
    void add(const Quadric& other)
    {
        squares += other.squares;
        products += other.products;
        b += other.b;
        c += other.c;
        weight += other.weight;
    }
    double mean_square(const glm::dvec3& x) const
    {
        const double square =
            glm::dot(squares, x * x) + 2.0 * (glm::dot(products, x * glm::dvec3(x.y, x.z, x.x)) + glm::dot(b, x)) + c;
        return weight > 0.0 ? std::max(square, 0.0) / weight : 0.0;
    }
};

/// A vertex that is moved onto one of its neighbours.
struct Collapse {
    std::uint32_t from, to;
};

/// Points of the surface are samples: all vertices that were removed, and others. Each is in the list of a face that is
/// near to it. Samples are numbered as vertices are; others come behind these.
///
/// The volume is divided into blocks. The inner vertices of a block are those whose faces have no vertex in another
/// block. Collapses of inner vertices of different blocks do not read what the others change, so that threads do them
/// at the same time, each in one block.
struct CollapsingMesh {
    static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

    /// `samples` are positions, up to a translation: those of the vertices, and others. All arguments must outlive it.
    CollapsingMesh(const LabeledMesh& mesh, const std::vector<glm::dvec3>& samples,
                   const std::vector<std::uint8_t>& locked)
        : lattice(mesh.vertices), world(samples), is_locked(locked),
          editable(mesh.vertices.size(), mesh.faces, mesh.labels), quadrics(mesh.vertices.size()),
          stamps(mesh.vertices.size(), 0), next_sample(world.size(), none), first_sample(mesh.faces.size(), none),
          is_changing(mesh.faces.size(), 0), item_of_face(mesh.faces.size(), 0), block_of(mesh.vertices.size(), 0),
          is_inner(mesh.vertices.size(), 1), is_queued(mesh.vertices.size(), 1)
    {
        for (const glm::uvec3& face : mesh.faces) {
            const auto [a, b, c] = corners(world, face);
            const glm::dvec3 normal = glm::cross(b - a, c - a);
            if (const double length = glm::length(normal); length > 0.0)
                for (int corner = 0; corner < 3; ++corner)
                    quadrics[face[corner]].add_plane(normal / length, glm::dot(normal / length, a), length);
        }
    }

    static std::array<glm::dvec3, 3> corners(const std::vector<glm::dvec3>& positions, const glm::uvec3& face)
    {
        return {positions[face.x], positions[face.y], positions[face.z]};
    }
    /// Whether a face has not become a line or a point.
    static bool is_left(const glm::uvec3& face) { return face.x != face.y && face.y != face.z && face.z != face.x; }

    void add_sample(std::uint32_t sample, std::uint32_t face)
    {
        next_sample[sample] = first_sample[face];
        first_sample[face] = sample;
    }

    const std::vector<glm::dvec3>& lattice; ///< positions of vertices
    const std::vector<glm::dvec3>& world;
    const std::vector<std::uint8_t>& is_locked; ///< for each vertex: it stays
    EditableMesh editable;
    std::vector<Quadric> quadrics;
    std::vector<std::uint32_t> stamps; ///< how often each vertex was pushed into a queue
    std::vector<std::uint32_t> next_sample, first_sample;
    std::vector<std::uint8_t> is_changing;   ///< for each face: a collapse is about to change it
    std::vector<std::uint32_t> item_of_face; ///< its number in the octree of its block
    std::vector<std::uint32_t> block_of;     ///< of each vertex
    // For each vertex:
    std::vector<std::uint8_t> is_inner;
    std::vector<std::uint8_t> is_queued; ///< it may be possible to collapse it
};

} // namespace isospline
