#include "isospline/query/cap_polygons.h"

#include "isospline/math/affine.h"
#include "isospline/math/box.h"
#include "isospline/math/clipped_box.h"
#include "isospline/trace/point_side.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace isospline {

namespace {

/// Whether a polygon in lattice space has no area, but for rounding.
bool is_empty(const ConvexPolygon& polygon)
{
    return !(width_of(polygon) > 2.0 * plane_margin);
}

/// The part of a plane within the domain and the clip, in lattice space.
ConvexPolygon polygon_of(const IsosurfaceSnapshot& surface, const HalfSpace& plane)
{
    ConvexPolygon polygon = section_of(domain_lattice(surface.volume()), plane);
    for (const HalfSpace& other : surface.clip_lattice())
        if (other != plane)
            polygon = cut(polygon, other.normal, other.offset);
    return polygon;
}

} // namespace

CapPolygons::CapPolygons(const IsosurfaceSnapshot& surface, const glm::dmat4& transform)
    : surface_(surface), to_world_(transform * surface.volume().lattice_to_world()),
      to_lattice_(glm::inverse(to_world_))
{
    const glm::dmat3 to_lattice(to_lattice_);
    for (std::size_t i = 0; i < surface.planes().all().size(); ++i) {
        if (!surface.planes().caps_have_area(i))
            continue;
        const HalfSpace& plane = surface.planes().all()[i];
        ConvexPolygon polygon = polygon_of(surface, plane);
        if (is_empty(polygon))
            continue;
        double error = 0.0;
        for (glm::dvec3& corner : polygon) {
            corner = transform_point(to_world_, corner);
            error = std::max(error, 2.0 * coordinate_error(to_lattice_, corner));
        }
        polygons_.push_back({std::move(polygon), -glm::normalize(plane.normal * to_lattice), i, error, std::nullopt});
    }
}

/// Only cells next to removed ones need parts of their own; elsewhere the whole polygon is used.
void CapPolygons::find_masked_parts()
{
    has_masked_parts_ = true;
    const glm::ivec3 end = surface_.volume().cell_shape() - 1;
    const CellSet& kept = surface_.kept_cells();
    const auto is_at_mask = [&](const glm::ivec3& cell) {
        return !kept.contains_all(glm::max(cell - 1, glm::ivec3(0)), glm::min(cell + 1, end));
    };
    for (const CapPolygon& whole : polygons_) {
        const HalfSpace& plane = surface_.planes().all()[whole.plane];
        const ConvexPolygon lattice = polygon_of(surface_, plane);
        Box box;
        for (const glm::dvec3& corner : lattice)
            box.extend(corner);
        const glm::dvec3 steepness = glm::abs(plane.normal);
        const double reach = 0.5 * (steepness.x + steepness.y + steepness.z);
        // Columns of cells along the axis to which the plane is steepest. The polygon's box limits the columns, not the
        // cells in them: if the plane is a face between two cells, the cap may be in either, on the inner side.
        const int axis = steepness.x >= std::max(steepness.y, steepness.z) ? 0 : steepness.y >= steepness.z ? 1 : 2;
        const int first_across = (axis + 1) % 3, second_across = (axis + 2) % 3;
        const glm::ivec3 first = glm::clamp(glm::ivec3(glm::floor(box.lower)), glm::ivec3(0), end);
        const glm::ivec3 last = glm::clamp(glm::ivec3(glm::floor(box.upper)), glm::ivec3(0), end);
        const auto add = [&](const glm::ivec3& cell) {
            const Box box_of_cell = box_of({cell, glm::ivec3(1)});
            if (!(DistanceRange(box_of_cell, plane).most > plane_margin))
                return; // the cap is in the cell on the inner side of its face
            ConvexPolygon part = lattice;
            for (const HalfSpace& side : half_spaces(box_of_cell))
                if (side != plane)
                    part = cut(part, side.normal, side.offset);
            if (is_empty(part))
                return;
            for (glm::dvec3& corner : part)
                corner = transform_point(to_world_, corner);
            masked_parts_.push_back({std::move(part), whole.normal, whole.plane, whole.coordinate_error, cell});
        };
        glm::ivec3 cell;
        for (int j = first[second_across]; j <= last[second_across]; ++j)
            for (int i = first[first_across]; i <= last[first_across]; ++i) {
                cell[first_across] = i;
                cell[second_across] = j;
                cell[axis] = 0;
                const double above = glm::dot(plane.normal, glm::dvec3(cell) + 0.5) - plane.offset;
                const double middle = -above / plane.normal[axis], margin = reach / steepness[axis];
                const int from = std::max(0, static_cast<int>(std::ceil(middle - margin - plane_margin)));
                const int to = std::min(end[axis], static_cast<int>(std::floor(middle + margin + plane_margin)));
                for (cell[axis] = from; cell[axis] <= to; ++cell[axis])
                    if (kept.contains(cell) && is_at_mask(cell))
                        add(cell);
            }
    }
}

/// Whether all cells at a point of a polygon, up to rounding, are kept: on a face, an edge or a corner several.
bool CapPolygons::is_away_from_mask(const CapPolygon& polygon, const glm::dvec3& point) const
{
    const glm::ivec3 end = surface_.volume().cell_shape() - 1;
    const glm::dvec3 lattice = transform_point(to_lattice_, point);
    const double margin = std::max(plane_margin, polygon.coordinate_error);
    return surface_.kept_cells().contains_all(glm::clamp(glm::ivec3(glm::floor(lattice - margin)), glm::ivec3(0), end),
                                              glm::clamp(glm::ivec3(glm::floor(lattice + margin)), glm::ivec3(0), end));
}

bool CapPolygons::is_on_cap(const CapPolygon& polygon, const glm::dvec3& point) const
{
    const glm::dvec3 lattice = transform_point(to_lattice_, point);
    const HalfSpace& plane = surface_.planes().all()[polygon.plane];
    const glm::ivec3 cell =
        polygon.cell ? *polygon.cell : inner_cell(surface_, lattice, plane, polygon.coordinate_error);
    // Points at the level are in a solid above it; of a solid below it they are the border, which the surface has as
    // well, or they are not near it.
    return is_inside(side_on_plane(surface_, lattice, polygon.coordinate_error, cell), surface_.inward_sign());
}

std::optional<CapPolygons::Point> CapPolygons::closest(const glm::dvec3& point, double limit)
{
    if (polygons_.empty())
        return std::nullopt;
    // Where only the largest components are kept, no cap ends at a cell that is not: it would be of the same component.
    const bool has_mask = !surface_.options().shell.mask.empty();
    if (has_mask && !has_masked_parts_)
        find_masked_parts();
    std::optional<Point> nearest;
    for (const std::vector<CapPolygon>* const parts : {&polygons_, &masked_parts_})
        for (const CapPolygon& polygon : *parts) {
            if (std::abs(glm::dot(polygon.normal, point - polygon.corners[0])) > limit)
                continue;
            const glm::dvec3 position = closest_point_of_polygon(point, polygon.corners);
            const double distance = glm::length(position - point);
            if (!(distance <= limit) || (nearest && distance == limit))
                continue;
            // Next to cells that are cut away, only the parts in single cells tell in which of the cells the cap is.
            if (has_mask && !polygon.cell && !is_away_from_mask(polygon, position))
                continue;
            if (!is_on_cap(polygon, position))
                continue;
            limit = distance;
            nearest = {position, polygon.normal, distance, surface_.cap_id(polygon.plane)};
        }
    return nearest;
}

} // namespace isospline
