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
/// The longest edge of the parts of a face where heights are measured first, in cells, and their number along an edge.
constexpr double first_part_edge = 2.0;
constexpr int most_first_parts = 8;
/// Planes at a smaller angle count as parallel.
constexpr double least_sine = 1e-3;
constexpr glm::dmat3 unit_vectors(1.0);

/// Calls `visit` with the barycentric coordinates of the points of a quadrature on a triangle, all of the same weight:
/// it is cut into `count`^2 equal parts, and each has the three points of the rule that is exact for quadratic
/// polynomials.
template <typename Visit>
void for_each_point(int count, const Visit& visit)
{
    const Corners corners{glm::dvec3(1.0, 0.0, 0.0), glm::dvec3(0.0, 1.0, 0.0), glm::dvec3(0.0, 0.0, 1.0)};
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

/// Whether a point is on a face across an axis with a kept cell on one side alone: at the border of the volume, or
/// where the mask ends.
bool is_between_kept_and_removed(const IsosurfaceSnapshot& surface, const glm::dvec3& point, int axis)
{
    if (point[axis] != std::floor(point[axis]))
        return false;
    const glm::ivec3 shape = surface.volume().cell_shape();
    glm::ivec3 above = glm::min(glm::ivec3(point), shape - 1), below = above;
    above[axis] = static_cast<int>(point[axis]);
    below[axis] = above[axis] - 1;
    const bool is_above_kept = above[axis] < shape[axis] && surface.kept_cells().contains(above);
    return is_above_kept != (below[axis] >= 0 && surface.kept_cells().contains(below));
}

/// Flags of the vertices at borders and on caps.
std::vector<std::uint8_t> ends_of_isosurface(const LabeledMesh& mesh)
{
    std::vector<std::uint8_t> flags = vertices_at_borders(mesh);
    for (std::size_t i = 0; i < mesh.faces.size(); ++i)
        if (mesh.labels[i] != on_isosurface)
            for (int corner = 0; corner < 3; ++corner)
                flags[mesh.faces[i][corner]] = 1;
    return flags;
}

} // namespace

template <int Degree>
VolumePreservation<Degree>::VolumePreservation(const LatticeField<Degree>& field, double reach)
    : field_(field), metric_(field.surface().volume().lattice_to_world()), reach_(reach),
      orientation_(glm::determinant(metric_.to_world) < 0.0 ? -1.0 : 1.0), shape_(field.surface().volume().cell_shape())
{
}

/// How far the surface is from a point in a direction of the world, in lengths of this vector; negative if it is
/// behind, and 0 if it is not found within the reach.
template <int Degree>
double VolumePreservation<Degree>::height(const glm::dvec3& at, const glm::dvec3& outward, double reach) const
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
        if (!(std::abs(height) <= reach))
            return 0.0;
        if (std::abs(step) <= small_step * reach_)
            return height;
    }
    return 0.0;
}

/// The area of a face in the world, as a vector to the outside.
template <int Degree>
glm::dvec3 VolumePreservation<Degree>::area_of(const Corners& corners) const
{
    const glm::dvec3 first = metric_.to_world * (corners[1] - corners[0]),
                     second = metric_.to_world * (corners[2] - corners[0]);
    return 0.5 * orientation_ * glm::cross(first, second);
}

/// The volume between a face and the surface, along directions in the world: those at the corners, interpolated.
///
/// With the points p and directions d of the face, x = p + h d maps the heights below that of the surface to what is
/// between. Its determinant is a quadratic polynomial in h.
template <int Degree>
double VolumePreservation<Degree>::volume_along(const Corners& corners, const Corners& directions,
                                                const Care& care) const
{
    const glm::dmat3 points(corners[0], corners[1], corners[2]), outward(directions[0], directions[1], directions[2]);
    const glm::dvec3 first = metric_.to_world * (corners[1] - corners[0]),
                     second = metric_.to_world * (corners[2] - corners[0]), first_turn = directions[1] - directions[0],
                     second_turn = directions[2] - directions[0];
    const glm::dvec3 constant = glm::cross(first, second),
                     linear = glm::cross(first, second_turn) + glm::cross(first_turn, second),
                     quadratic = glm::cross(first_turn, second_turn);
    const auto measured = [&](int count) {
        double sum = 0.0;
        for_each_point(count, [&](const glm::dvec3& weights) {
            const glm::dvec3 direction = outward * weights;
            const double h = height(points * weights, direction, care.reach * reach_);
            sum += h * glm::dot(constant + h * (linear / 2.0 + h / 3.0 * quadratic), direction);
        });
        return 0.5 * orientation_ * sum / (3.0 * count * count);
    };
    double longest = 0.0;
    for (std::size_t i = 0; i < 3; ++i)
        longest = std::max(longest, glm::distance(corners[i], corners[(i + 1) % 3]));
    int count = std::clamp(static_cast<int>(std::ceil(longest / first_part_edge)), 1, most_first_parts);
    double volume = measured(count);
    for (double edge = first_part_edge; edge > care.part_edge && longest > care.part_edge * count; edge *= 0.5) {
        const double before = volume;
        volume = measured(count *= 2);
        if (std::abs(volume - before) <= care.small_change * reach_ * 0.5 * glm::length(constant))
            break;
    }
    return volume;
}

template <int Degree>
typename VolumePreservation<Degree>::Between VolumePreservation<Degree>::between(const Corners& corners) const
{
    const glm::dvec3 area = area_of(corners);
    const double size = glm::length(area);
    if (!(size > 0.0))
        return {0.0, glm::dvec3(0.0)};
    const glm::dvec3 normal = area / size;
    return {volume_along(corners, {normal, normal, normal}, care_of_moves), area};
}

/// Directions at the vertices, in the world: the normals of the isosurface's faces around them, on a cap and at an end
/// along its plane. What is between neighbouring faces and the surface then does not overlap, and ends where the solid
/// does.
template <int Degree>
std::vector<glm::dvec3> VolumePreservation<Degree>::directions(const LabeledMesh& mesh) const
{
    std::vector<glm::dvec3> directions(mesh.vertices.size(), glm::dvec3(0.0)), planes = directions;
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
        if (mesh.labels[i] != on_isosurface)
            continue;
        const glm::dvec3 area = area_of(corners_of(mesh, i));
        for (int corner = 0; corner < 3; ++corner)
            directions[mesh.faces[i][corner]] += area;
    }
    const auto keep_in_plane = [&](std::size_t vertex, const glm::dvec3& normal_lattice) {
        const glm::dvec3 plane = glm::normalize(normal_lattice * metric_.to_lattice);
        // A vertex of two planes has the direction of the line where they meet.
        const glm::dvec3 across = plane - glm::dot(plane, planes[vertex]) * planes[vertex];
        if (glm::length(across) < least_sine)
            return;
        planes[vertex] = glm::normalize(across);
        directions[vertex] -= glm::dot(directions[vertex], planes[vertex]) * planes[vertex];
    };
    for (std::size_t i = 0; i < mesh.faces.size(); ++i)
        if (mesh.labels[i] != on_isosurface)
            for (int corner = 0; corner < 3; ++corner)
                keep_in_plane(mesh.faces[i][corner], field_.surface().planes().all()[mesh.labels[i] - 1].normal);
    const std::vector<std::uint8_t> is_end = ends_of_isosurface(mesh);
    for (std::size_t i = 0; i < is_end.size(); ++i) {
        if (is_end[i] == 0)
            continue;
        const glm::dvec3& vertex = mesh.vertices[i];
        for (int axis = 0; axis < 3; ++axis)
            if (is_between_kept_and_removed(field_.surface(), vertex, axis))
                keep_in_plane(i, unit_vectors[axis]);
        for (const HalfSpace& half_space : field_.surface().clip_lattice())
            if (std::abs(glm::dot(half_space.normal, vertex) - half_space.offset) < plane_margin)
                keep_in_plane(i, half_space.normal);
    }
    for (glm::dvec3& direction : directions)
        if (const double length = glm::length(direction); length > 0.0)
            direction /= length;
    return directions;
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
    const std::vector<glm::dvec3> of_vertices = directions(mesh);
    parallel_for(
        mesh.faces.size(), 1024,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                if (mesh.labels[i] == on_isosurface)
                    volumes[i] =
                        volume_along(corners_of(mesh, i), corners_of(of_vertices, mesh.faces[i]), care_of_report);
        },
        progress);
    return std::accumulate(volumes.begin(), volumes.end(), 0.0);
}

template class VolumePreservation<1>;
template class VolumePreservation<2>;
template class VolumePreservation<3>;

} // namespace isospline
