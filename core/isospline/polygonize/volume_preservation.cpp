#include "isospline/polygonize/volume_preservation.h"

#include "isospline/polygonize/editable_mesh.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

namespace isospline {

namespace {

/// The largest step, as a part of the reach.
constexpr double largest_step = 0.5;
/// The edges of the parts of a face, each with three points, in cells.
constexpr double part_edge = 2.0;
constexpr int most_parts = 8;

/// Calls `visit` with the points of a quadrature on a triangle, all of the same weight: it is cut into `count`^2 equal
/// parts, and each has the three points of the rule that is exact for quadratic polynomials.
template <typename Visit>
void for_each_point(const Corners& corners, int count, const Visit& visit)
{
    const glm::dvec3 along_first = (corners[1] - corners[0]) / static_cast<double>(count);
    const glm::dvec3 along_second = (corners[2] - corners[0]) / static_cast<double>(count);
    const auto visit_part = [&](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
        const glm::dvec3 sum = a + b + c;
        for (const glm::dvec3& corner : {a, b, c})
            visit((sum + 3.0 * corner) / 6.0);
    };
    for (int i = 0; i < count; ++i)
        for (int j = 0; i + j < count; ++j) {
            const glm::dvec3 at =
                corners[0] + static_cast<double>(i) * along_first + static_cast<double>(j) * along_second;
            visit_part(at, at + along_first, at + along_second);
            if (i + j + 1 < count)
                visit_part(at + along_first, at + along_first + along_second, at + along_second);
        }
}

/// Flags of the vertices at borders and on caps.
std::vector<std::uint8_t> ends_of_isosurface(const LabeledMesh& mesh)
{
    std::vector<std::uint8_t> flags(mesh.vertices.size(), 0);
    // Around any other vertex, each neighbour is the second corner of one face and the third corner of another.
    std::vector<std::int64_t> balance(mesh.vertices.size(), 0);
    for (std::size_t i = 0; i < mesh.faces.size(); ++i)
        for (int corner = 0; corner < 3; ++corner) {
            const std::uint32_t vertex = mesh.faces[i][corner];
            balance[vertex] += std::int64_t{mesh.faces[i][(corner + 1) % 3]} - mesh.faces[i][(corner + 2) % 3];
            if (mesh.labels[i] != on_isosurface)
                flags[vertex] = 1;
        }
    for (std::size_t i = 0; i < flags.size(); ++i)
        flags[i] |= static_cast<std::uint8_t>(balance[i] != 0);
    return flags;
}

} // namespace

template <int Degree>
VolumePreservation<Degree>::VolumePreservation(const LatticeField<Degree>& field, double reach)
    : field_(field), metric_(field.surface().volume().lattice_to_world()), reach_(reach),
      orientation_(glm::determinant(metric_.to_world) < 0.0 ? -1.0 : 1.0), shape_(field.surface().volume().cell_shape())
{
}

/// How far the surface is from a point in a direction, a unit vector in the world; negative if it is behind, and 0 if
/// it is not found.
template <int Degree>
double VolumePreservation<Degree>::height(const glm::dvec3& at, const glm::dvec3& outward) const
{
    constexpr int most_iterations = 6;
    constexpr double small_step = 0.01;
    const glm::dvec3 direction = metric_.to_lattice * outward;
    double height = 0.0;
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
        const glm::dvec3 place = at + height * direction;
        if (place != glm::clamp(place, glm::dvec3(0.0), shape_))
            return 0.0;
        const PointInCell point(field_.surface(), place);
        const auto [value, gradient] = scalar::value_and_gradient_in_cell<Degree>(point.cell, point.local);
        const double slope = glm::dot(glm::dvec3(gradient[0], gradient[1], gradient[2]), direction);
        if (!(field_.surface().inward_sign() * slope < 0.0))
            return 0.0;
        const double step = -value / slope;
        height += step;
        if (!(std::abs(height) <= reach_))
            return 0.0;
        if (std::abs(step) <= small_step * reach_)
            return height;
    }
    return 0.0;
}

template <int Degree>
typename VolumePreservation<Degree>::Between VolumePreservation<Degree>::between(const Corners& corners) const
{
    const glm::dvec3 first = metric_.to_world * (corners[1] - corners[0]),
                     second = metric_.to_world * (corners[2] - corners[0]);
    const glm::dvec3 area = 0.5 * orientation_ * glm::cross(first, second);
    const double size = glm::length(area);
    if (!(size > 0.0))
        return {0.0, glm::dvec3(0.0)};
    double longest = 0.0;
    for (std::size_t i = 0; i < 3; ++i)
        longest = std::max(longest, glm::distance(corners[i], corners[(i + 1) % 3]));
    const int count = std::clamp(static_cast<int>(std::ceil(longest / part_edge)), 1, most_parts);
    double sum = 0.0;
    for_each_point(corners, count, [&](const glm::dvec3& at) { sum += height(at, area / size); });
    return {sum / (3.0 * count * count) * size, area};
}

/// The volumes at all faces of a mesh whose vertices have these numbers. Faces that were measured before, and are where
/// they were, are not measured again.
template <int Degree>
std::vector<typename VolumePreservation<Degree>::Between>
VolumePreservation<Degree>::measure(const LabeledMesh& mesh, const std::vector<std::uint32_t>& numbers,
                                    std::vector<Measured>& before, const Progress& progress) const
{
    std::vector<Measured> measured(mesh.faces.size());
    parallel_for(
        mesh.faces.size(), 1024,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const glm::uvec3& face = mesh.faces[i];
                Measured& of_face = measured[i];
                of_face = {{numbers[face.x], numbers[face.y], numbers[face.z]}, corners_of(mesh, i), {}};
                if (mesh.labels[i] != on_isosurface)
                    continue;
                const auto known = std::lower_bound(
                    before.begin(), before.end(), of_face.face,
                    [](const Measured& other, const glm::uvec3& wanted) { return is_face_before(other.face, wanted); });
                const bool is_known =
                    known != before.end() && known->face == of_face.face && known->corners == of_face.corners;
                of_face.between = is_known ? known->between : between(of_face.corners);
            }
        },
        progress);
    std::vector<Between> found(measured.size());
    std::transform(measured.begin(), measured.end(), found.begin(), [](const Measured& of) { return of.between; });
    std::sort(measured.begin(), measured.end(),
              [](const Measured& a, const Measured& b) { return is_face_before(a.face, b.face); });
    before = std::move(measured);
    return found;
}

template <int Degree>
void VolumePreservation<Degree>::move(LabeledMesh& mesh, const std::vector<std::uint8_t>& stays,
                                      const Progress& progress)
{
    LabeledMesh used = mesh; // most vertices of a simplified mesh have no faces
    const std::vector<std::uint32_t> numbers = drop_unused_vertices(used);
    const std::vector<std::uint8_t> is_fixed = ends_of_isosurface(used);
    struct Around {
        double volume = 0.0, area = 0.0;
        glm::dvec3 vector_area{0.0};
    };
    for (int step = 0; step < step_count; ++step) {
        const std::vector<Between> of_faces =
            measure(used, numbers, before_[static_cast<std::size_t>(step)],
                    part_of(progress, static_cast<double>(step) / step_count, (step + 1.0) / step_count));
        std::vector<Around> around(numbers.size());
        for (std::size_t i = 0; i < used.faces.size(); ++i)
            for (int corner = 0; corner < 3; ++corner) {
                Around& of_vertex = around[used.faces[i][corner]];
                of_vertex.volume += of_faces[i].volume;
                of_vertex.area += glm::length(of_faces[i].area);
                of_vertex.vector_area += of_faces[i].area;
            }
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            const double length = glm::length(around[i].vector_area);
            if (is_fixed[i] != 0 || stays[numbers[i]] != 0 || !(length > 0.0))
                continue;
            // At a sharp edge or a tip, the area across the normal is small.
            const double distance = std::clamp(around[i].volume / std::max(length, 0.5 * around[i].area),
                                               -largest_step * reach_, largest_step * reach_);
            const glm::dvec3 step_lattice = metric_.to_lattice * (distance / length * around[i].vector_area);
            used.vertices[i] = glm::clamp(used.vertices[i] + step_lattice, glm::dvec3(0.0), shape_);
        }
    }
    for (std::size_t i = 0; i < numbers.size(); ++i)
        mesh.vertices[numbers[i]] = used.vertices[i];
}

template <int Degree>
double VolumePreservation<Degree>::missing_volume(const LabeledMesh& mesh, const Progress& progress) const
{
    std::vector<double> volumes(mesh.faces.size(), 0.0);
    parallel_for(
        mesh.faces.size(), 1024,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                if (mesh.labels[i] == on_isosurface)
                    volumes[i] = between(corners_of(mesh, i)).volume;
        },
        progress);
    return std::accumulate(volumes.begin(), volumes.end(), 0.0);
}

template class VolumePreservation<1>;
template class VolumePreservation<2>;
template class VolumePreservation<3>;

} // namespace isospline
