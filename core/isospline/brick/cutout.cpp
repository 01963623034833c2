#include "isospline/brick/cutout.h"

#include "isospline/spline/volume.h"
#include "isospline/util/check.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

HalfSpace pull_back(const HalfSpace& half_space, const glm::dmat4& map)
{
    // <normal, A x + b> >= offset. Components are scaled to 1 so that the square of the length does not overflow.
    const auto largest = [](const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); };
    const glm::dvec3 scaled = half_space.normal / largest(half_space.normal);
    const glm::dvec3 normal = glm::transpose(glm::dmat3(map)) * scaled;
    const double offset = half_space.offset / largest(half_space.normal) - glm::dot(scaled, glm::dvec3(map[3]));
    const double length = largest(normal) * glm::length(normal / largest(normal));
    return {normal / length, offset / length};
}

std::vector<HalfSpace> half_spaces(const Box& box)
{
    if (!(box.lower.x < box.upper.x && box.lower.y < box.upper.y && box.lower.z < box.upper.z))
        throw_invalid("box", "a minimum below the maximum along each axis",
                      to_text(box.lower) + " and " + to_text(box.upper));
    std::vector<HalfSpace> sides;
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 normal(0.0);
        normal[axis] = 1.0;
        if (std::isfinite(box.lower[axis]))
            sides.push_back({normal, box.lower[axis]});
        if (std::isfinite(box.upper[axis]))
            sides.push_back({-normal, -box.upper[axis]});
    }
    return sides;
}

std::optional<Chord> clip(const Ray& ray, const std::vector<HalfSpace>& half_spaces)
{
    Chord inside{{ray.t_near, ray.t_far}};
    for (std::size_t i = 0; i < half_spaces.size(); ++i) {
        const HalfSpace& half_space = half_spaces[i];
        const double distance = half_space.offset - glm::dot(half_space.normal, ray.origin);
        const double speed = glm::dot(half_space.normal, ray.direction);
        const double t = distance / speed;
        if (speed > 0.0 && (t > inside.t_near || (t == inside.t_near && inside.entry < 0))) {
            inside.t_near = std::max(inside.t_near, t);
            inside.entry = static_cast<int>(i);
        } else if (speed < 0.0 && (t < inside.t_far || (t == inside.t_far && inside.exit < 0))) {
            inside.t_far = std::min(inside.t_far, t);
            inside.exit = static_cast<int>(i);
        } else if (speed == 0.0 && distance > 0.0) {
            return std::nullopt;
        }
    }
    if (!(inside.t_near <= inside.t_far))
        return std::nullopt;
    return inside;
}

bool is_cut_by_mask(const glm::ivec3& cell, const Mask& mask, const Volume& volume)
{
    const glm::vec<3, std::size_t> shape(volume.shape()), first(cell);
    const int samples = volume.degree() % 2 == 0 ? 1 : 2;
    for (int sample = 0; sample < samples * samples * samples; ++sample) {
        const std::size_t i = first.x + (sample & 1), j = first.y + (sample >> 1 & 1), k = first.z + (sample >> 2);
        if (mask[i + shape.x * (j + shape.y * k)] == 0)
            return true;
    }
    return false;
}

void cut_by_mask(BrickCells& cells, const Brick& brick, const Mask& mask, const Volume& volume)
{
    remove_cells(cells,
                 [&](int x, int y, int z) { return is_cut_by_mask(brick.first + glm::ivec3(x, y, z), mask, volume); });
}

namespace {

/// Far above the rounding of distances in a grid of 65535 cells. A cell that is kept because of it does no harm.
constexpr double cut_margin = 1e-9;

/// The distances of a brick's points from a plane, positive inside.
struct Distances {
    Distances(const Brick& brick, const HalfSpace& half_space)
    {
        const glm::dvec3 half_size = 0.5 * glm::dvec3(brick.size);
        const double middle = glm::dot(half_space.normal, glm::dvec3(brick.first) + half_size) - half_space.offset;
        const double reach = glm::dot(glm::abs(half_space.normal), half_size);
        least = middle - reach;
        most = middle + reach;
    }

    double least, most;
};

} // namespace

bool is_outside(const Brick& brick, const HalfSpace& half_space_lattice)
{
    return Distances(brick, half_space_lattice).most < -cut_margin;
}

void cut_by_half_space(BrickCells& cells, const Brick& brick, const HalfSpace& half_space_lattice)
{
    const Distances distances(brick, half_space_lattice);
    if (distances.least >= 0.0)
        return;
    const glm::dvec3& normal = half_space_lattice.normal;
    const double reach = 0.5 * (std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z));
    const double first_distance = glm::dot(normal, glm::dvec3(brick.first) + 0.5) - half_space_lattice.offset;
    remove_cells(cells, [&](int x, int y, int z) {
        return first_distance + glm::dot(normal, glm::dvec3(x, y, z)) + reach < -cut_margin;
    });
}

} // namespace isospline
