#include "isospline/trace/cap.h"

#include "isospline/brick/brick.h"
#include "isospline/cell/value-inl.h"
#include "isospline/cell/value_error.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/point_in_cell.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace isospline {

namespace {

/// Where a point is, as far as double precision can decide.
enum class Side { outside, undecided, inside };

/// Whether a point is in the solid: in the domain, as far as double precision can decide, in a cell that the mask
/// keeps, and on the inner side.
Side side_of(const IsosurfaceSnapshot& surface, const CappedChord& chord, double t)
{
    const Volume& volume = surface.volume();
    const glm::dvec3 lattice = chord.at(t);
    const glm::dvec3 shape(volume.cell_shape());
    double size = 1.0;
    for (int axis = 0; axis < 3; ++axis)
        size = std::max(size, std::abs(chord.origin[axis]) + std::abs(t * chord.direction[axis]));
    const double coordinate_error = 8.0 * 0x1p-53 * size;
    for (int axis = 0; axis < 3; ++axis)
        if (!(lattice[axis] >= -coordinate_error && lattice[axis] <= shape[axis] + coordinate_error))
            return Side::outside;
    const PointInCell point(surface, lattice);
    if (!surface.kept_cells().contains(point.index))
        return Side::outside;

    return dispatch_degree(volume.degree(), [&](auto degree) {
        const double value = scalar::value_in_cell<degree>(point.cell, point.local);
        const double error = value_error<degree>(point.cell, coordinate_error);
        const double inward = surface.options().inside == Inside::above ? value : -value;
        if (inward > error)
            return Side::inside;
        // A cell that is completely at the level has no error, and no inside.
        return inward > -error ? Side::undecided : Side::outside;
    });
}

/// Margin for rounding when boxes are narrowed.
constexpr double box_margin = 1e-6;

/// Whether the coefficients of a brick, within rounding, allow it to contain a part of the solid.
bool may_hold_solid(const BrickRanges::Range& range, double threshold, Inside inside)
{
    const double lower = static_cast<double>(range.lower) - threshold;
    const double upper = static_cast<double>(range.upper) - threshold;
    const double error = 1e-6 * std::max(std::abs(lower), std::abs(upper));
    return inside == Inside::above ? upper > -error : lower < error;
}

/// Narrows a box, axis by axis, to the part that a half-space can keep.
void narrow(Box& box, const HalfSpace& half_space)
{
    const glm::dvec3& normal = half_space.normal;
    const glm::dvec3 most = glm::max(normal * box.lower, normal * box.upper);
    for (int axis = 0; axis < 3; ++axis) {
        // Narrowing by the other axes is enough if this one hardly matters.
        if (std::abs(normal[axis]) < 1e-3)
            continue;
        const double rest = half_space.offset - (most.x + most.y + most.z - most[axis]);
        if (normal[axis] > 0.0)
            box.lower[axis] = std::max(box.lower[axis], rest / normal[axis] - box_margin);
        else
            box.upper[axis] = std::min(box.upper[axis], rest / normal[axis] + box_margin);
    }
}

} // namespace

bool CappedChord::enters_cap(const IsosurfaceSnapshot& surface) const
{
    return entry >= 0 && t_near < t_far && side_of(surface, *this, t_near) != Side::outside;
}

bool CappedChord::leaves_cap(const IsosurfaceSnapshot& surface) const
{
    return exit >= 0 && t_near < t_far && side_of(surface, *this, t_far) != Side::outside;
}

CappedEnds CappedChord::capped_ends(const IsosurfaceSnapshot& surface, std::optional<bool> first_enters,
                                    std::optional<bool> last_enters) const
{
    if (!(t_near < t_far))
        return {};
    const Side first = side_of(surface, *this, t_near), last = side_of(surface, *this, t_far);
    // Without a crossing in between, both ends are on the same side.
    const auto decide = [](Side side, std::optional<bool> by_crossing, Side other) {
        if (side == Side::undecided && by_crossing)
            return *by_crossing;
        return (side == Side::undecided ? other : side) != Side::outside;
    };
    const std::optional<bool> first_leaves = first_enters ? std::optional(!*first_enters) : std::nullopt;
    return {entry >= 0 && decide(first, first_leaves, last), exit >= 0 && decide(last, last_enters, first)};
}

glm::dvec3 gradient_lattice(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice)
{
    const PointInCell point(surface, lattice);
    return dispatch_degree(surface.volume().degree(),
                           [&](auto degree) { return scalar::gradient_in_cell<degree>(point.cell, point.local); });
}

std::vector<Box> cap_boxes(const IsosurfaceSnapshot& surface)
{
    std::vector<Box> boxes;
    if (!surface.options().capped)
        return boxes;
    const std::vector<HalfSpace>& clip = surface.clip_lattice();
    const BrickRanges& ranges = *surface.shared_ranges();
    for (std::size_t index = 0; index < 8 * ranges.octets().size(); ++index) {
        const auto child = static_cast<int>(index % 8);
        const glm::ivec3 position = 2 * at_place(ranges.shape(), index / 8) + child_position(child);
        const Brick brick = brick_at(surface.volume().cell_shape(), position);
        if (glm::any(glm::lessThanEqual(brick.size, glm::ivec3(0))) || surface.kept_cells().has_none_of(brick) ||
            !may_hold_solid(ranges.octets()[index / 8].brick(index % 8), surface.threshold(), surface.options().inside))
            continue;
        const Box cells{glm::dvec3(brick.first), glm::dvec3(brick.first + brick.size)};
        for (const HalfSpace& plane : clip) {
            const double distance = glm::dot(plane.normal, cells.center()) - plane.offset;
            if (std::abs(distance) > 0.5 * glm::dot(glm::abs(plane.normal), cells.size()) + box_margin)
                continue;
            Box box = cells;
            narrow(box, {-plane.normal, -plane.offset});
            for (const HalfSpace& half_space : clip)
                narrow(box, half_space);
            if (!box.empty())
                boxes.push_back(box);
        }
    }
    return boxes;
}

} // namespace isospline
