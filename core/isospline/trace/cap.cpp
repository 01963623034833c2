#include "isospline/trace/cap.h"

#include "isospline/brick/brick.h"
#include "isospline/cell/value-inl.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/point_in_cell.h"
#include "isospline/trace/point_side.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace isospline {

namespace {

/// The side of an end of a chord, given the number of its plane, or -1.
Side side_of(const IsosurfaceSnapshot& surface, const CappedChord& chord, double t, int plane)
{
    double size = 1.0;
    for (int axis = 0; axis < 3; ++axis)
        size = std::max(size, std::abs(chord.origin[axis]) + std::abs(t * chord.direction[axis]));
    const glm::dvec3 end = chord.at(t);
    const double error = 8.0 * 0x1p-53 * size;
    if (plane < 0)
        return side_of(surface, end, error);
    const HalfSpace& half_space = surface.planes().all()[static_cast<std::size_t>(plane)];
    return side_on_plane(surface, end, error, inner_cell(surface, end, half_space, error));
}

/// Whether the coefficients of a brick, within rounding, allow it to contain a part of the solid.
bool may_hold_solid(const BrickRanges::Range& range, const IsosurfaceSnapshot& surface)
{
    const double lower = static_cast<double>(range.lower) - surface.threshold();
    const double upper = static_cast<double>(range.upper) - surface.threshold();
    const double most = std::max(surface.inward_sign() * lower, surface.inward_sign() * upper);
    return most >= -1e-6 * std::max(std::abs(lower), std::abs(upper));
}

/// Narrows a box, axis by axis, to the part that a half-space can keep, with a margin for rounding.
void narrow(Box& box, const HalfSpace& half_space)
{
    const glm::dvec3& normal = half_space.normal;
    const glm::dvec3 most = glm::max(normal * box.lower, normal * box.upper);
    constexpr double least_component = 1e-3, margin = plane_margin / least_component;
    for (int axis = 0; axis < 3; ++axis) {
        // Narrowing by the other axes is enough if this one hardly matters.
        if (std::abs(normal[axis]) < least_component)
            continue;
        const double rest = half_space.offset - (most.x + most.y + most.z - most[axis]);
        if (normal[axis] > 0.0)
            box.lower[axis] = std::max(box.lower[axis], rest / normal[axis] - margin);
        else
            box.upper[axis] = std::min(box.upper[axis], rest / normal[axis] + margin);
    }
}

} // namespace

bool CappedChord::enters_cap(const IsosurfaceSnapshot& surface) const
{
    return entry >= 0 && t_near < t_far && side_of(surface, *this, t_near, entry) != Side::outside;
}

bool CappedChord::leaves_cap(const IsosurfaceSnapshot& surface) const
{
    return exit >= 0 && t_near < t_far && side_of(surface, *this, t_far, exit) != Side::outside;
}

CappedEnds CappedChord::capped_ends(const IsosurfaceSnapshot& surface, std::optional<bool> first_enters,
                                    std::optional<bool> last_enters) const
{
    if (!(t_near < t_far))
        return {};
    const Side first = side_of(surface, *this, t_near, entry), last = side_of(surface, *this, t_far, exit);
    // Without a crossing in between, both ends are on the same side.
    const auto decide = [](Side side, std::optional<bool> by_crossing, Side other) {
        if (side == Side::unknown && by_crossing)
            return *by_crossing;
        return (side == Side::unknown ? other : side) != Side::outside;
    };
    const std::optional<bool> first_leaves = first_enters ? std::optional(!*first_enters) : std::nullopt;
    return {entry >= 0 && decide(first, first_leaves, last), exit >= 0 && decide(last, last_enters, first)};
}

std::optional<CappedEnds> CappedChord::certain_ends(const IsosurfaceSnapshot& surface) const
{
    if (!(t_near < t_far))
        return CappedEnds{};
    const Side first = entry >= 0 ? side_of(surface, *this, t_near, entry) : Side::outside;
    const Side last = exit >= 0 ? side_of(surface, *this, t_far, exit) : Side::outside;
    if (first == Side::unknown || last == Side::unknown)
        return std::nullopt;
    return CappedEnds{first != Side::outside, last != Side::outside};
}

glm::dvec3 gradient_lattice(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice)
{
    const PointInCell point(surface, lattice);
    return dispatch_degree(surface.volume().degree(),
                           [&](auto degree) { return scalar::gradient_in_cell<degree>(point.cell, point.local); });
}

CapBoxes cap_boxes(const IsosurfaceSnapshot& surface)
{
    const SolidPlanes& planes = surface.planes();
    CapBoxes caps{{}, std::vector<bool>(planes.all().size())};
    if (!planes.have_caps())
        return caps;
    const BrickRanges& ranges = *surface.shared_ranges();
    for (std::size_t index = 0; index < 8 * ranges.octets().size(); ++index) {
        const auto child = static_cast<int>(index % 8);
        const glm::ivec3 position = 2 * at_place(ranges.shape(), index / 8) + child_position(child);
        const Brick brick = brick_at(surface.volume().cell_shape(), position);
        if (glm::any(glm::lessThanEqual(brick.size, glm::ivec3(0))) || surface.kept_cells().has_none_of(brick) ||
            !may_hold_solid(ranges.octets()[index / 8].brick(index % 8), surface))
            continue;
        const Box cells = box_of(brick);
        for (std::size_t i = 0; i < planes.all().size(); ++i) {
            const HalfSpace& plane = planes.all()[i];
            if (!planes.caps_have_area(i) || is_outside(cells, plane) || is_inside(cells, plane))
                continue;
            Box box = cells;
            narrow(box, {-plane.normal, -plane.offset});
            for (const HalfSpace& half_space : surface.clip_lattice())
                narrow(box, half_space);
            if (box.empty())
                continue;
            caps.boxes.push_back(box);
            caps.of_plane[i] = true;
        }
    }
    return caps;
}

} // namespace isospline
