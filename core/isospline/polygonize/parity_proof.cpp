#include "isospline/polygonize/parity_proof.h"

#include "isospline/polygonize/clipped_triangle.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

namespace isospline {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
/// Bounds of rounding errors: of coordinates, and of areas, as parts of the lengths that they come from.
constexpr double rounding = 0x1p-44, rounding_of_area = 0x1p-46;

/// Whether a line along z crosses a triangle; nothing if rounding errors decide. The triangles at an edge agree on
/// which side of it the line is: they compute this from the same numbers in the same order.
std::optional<bool> is_crossed(const glm::dvec3& at, const Corners& corners, const glm::uvec3& face)
{
    int above = 0, below = 0;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        const bool is_turned = face[i] > face[j];
        const glm::dvec3 &from = corners[static_cast<std::size_t>(is_turned ? j : i)],
                         &to = corners[static_cast<std::size_t>(is_turned ? i : j)];
        const double first = (to.x - from.x) * (at.y - from.y), second = (to.y - from.y) * (at.x - from.x);
        const double area = first - second;
        if (std::abs(area) <= rounding_of_area * (std::abs(first) + std::abs(second)))
            continue;
        ++((area > 0.0) != is_turned ? above : below);
    }
    if (above != 0 && below != 0)
        return false;
    if (above == 3 || below == 3)
        return true;
    const Box box = box_of(corners);
    if (at.x < box.lower.x || at.x > box.upper.x || at.y < box.lower.y || at.y > box.upper.y)
        return false;
    return std::nullopt;
}

} // namespace

ParityProof::ParityProof(const LabeledMesh& mesh, const std::vector<glm::dvec3>& world)
    : mesh_(mesh), world_(world), is_at_border_(vertices_at_borders(mesh))
{
}

std::optional<double> ParityProof::distance(const std::vector<glm::dvec3>& points, const glm::dvec3& normal,
                                            const std::vector<std::uint32_t>& faces, double most,
                                            Workspace& workspace) const
{
    const double length = glm::length(normal);
    if (!(length > 0.0 && length < infinity))
        return std::nullopt;
    // Coordinates along two directions across the normal, and along it.
    const glm::dvec3 n = normal / length, size = glm::abs(n);
    glm::dvec3 axis(0.0);
    axis[size.x <= size.y && size.x <= size.z ? 0 : size.y <= size.z ? 1 : 2] = 1.0;
    const glm::dvec3 u = glm::normalize(glm::cross(n, axis));
    const glm::dmat3 to_frame = glm::transpose(glm::dmat3(u, glm::cross(n, u), n));
    const glm::dvec3 origin = points.front();
    const auto in_frame = [&](const glm::dvec3& point) { return to_frame * (point - origin); };
    workspace.points.resize(points.size());
    std::transform(points.begin(), points.end(), workspace.points.begin(), in_frame);
    Box hull;
    for (const glm::dvec3& point : workspace.points)
        hull.extend(point);
    const double extent = glm::length(hull.size()) + most, slack = rounding * (extent + glm::length(origin));
    hull.lower -= slack;
    hull.upper += slack;
    if (hull.upper.z - hull.lower.z >= 2.0 * most)
        return std::nullopt;

    double least = infinity, largest = -infinity; // heights of the faces where the hull is
    workspace.crossed.clear();
    for (const std::uint32_t index : faces) {
        const glm::uvec3& face = mesh_.faces[index];
        const Corners corners{in_frame(world_[face.x]), in_frame(world_[face.y]), in_frame(world_[face.z])};
        Box box = box_of(corners);
        const auto is_beside = [&] { return box.upper.z < hull.lower.z - most || box.lower.z > hull.upper.z + most; };
        if (is_beside() || box.upper.x < hull.lower.x || box.lower.x > hull.upper.x || box.upper.y < hull.lower.y ||
            box.lower.y > hull.upper.y)
            continue;
        if (box.lower.z <= hull.upper.z - most || box.upper.z >= hull.lower.z + most) {
            ClippedTriangle part(corners);
            for (int side = 0; side < 2; ++side)
                part = part.cut(side, hull.upper[side], false).cut(side, hull.lower[side], true);
            if (part.has_too_many)
                return std::nullopt;
            box = part.box();
            if (part.count == 0 || is_beside())
                continue;
        }
        if (is_at_border_[face.x] != 0 || is_at_border_[face.y] != 0 || is_at_border_[face.z] != 0)
            return std::nullopt;
        least = std::min(least, box.lower.z);
        largest = std::max(largest, box.upper.z);
        if (least <= hull.upper.z - most || largest >= hull.lower.z + most)
            return std::nullopt;
        workspace.crossed.push_back({corners, face});
    }
    const double distance = std::max(largest - hull.lower.z, hull.upper.z - least) + slack;
    if (!(distance <= most))
        return std::nullopt;

    // The crossings at one point: the middle, or one beside it.
    const glm::dvec3 middle = std::accumulate(workspace.points.begin(), workspace.points.end(), glm::dvec3(0.0)) /
                              static_cast<double>(points.size());
    constexpr int most_tries = 3;
    for (int attempt = 0; attempt < most_tries; ++attempt) {
        const glm::dvec3 at = glm::mix(middle, workspace.points[static_cast<std::size_t>(attempt) % points.size()],
                                       0.3 * static_cast<double>(attempt));
        bool is_odd = false, is_sure = true;
        for (const auto& [corners, face] : workspace.crossed) {
            const auto crosses = is_crossed(at, corners, face);
            is_sure &= crosses.has_value();
            is_odd ^= crosses.value_or(false);
        }
        if (is_sure)
            return is_odd ? std::optional(distance) : std::nullopt;
    }
    return std::nullopt;
}

} // namespace isospline
