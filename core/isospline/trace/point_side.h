// Where a point is with respect to the solid that an isosurface bounds: one decision for caps and queries of points.
#pragma once

#include "isospline/brick/side.h"
#include "isospline/shell/isosurface.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>

namespace isospline {

// Points are in lattice space. The errors of their coordinates are up to `coordinate_error`.

/// Whether a point may be in the domain.
inline bool is_in_domain(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error)
{
    const glm::dvec3 last = glm::dvec3(surface.volume().cell_shape()) + coordinate_error;
    return lattice.x >= -coordinate_error && lattice.y >= -coordinate_error && lattice.z >= -coordinate_error &&
           lattice.x <= last.x && lattice.y <= last.y && lattice.z <= last.z;
}

/// Whether a point may be that of a sample.
bool is_at_sample(const Volume& volume, const glm::dvec3& lattice, double coordinate_error);

/// Whether a point may be in all half-spaces of the clip.
inline bool is_in_clip(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error)
{
    for (const HalfSpace& half_space : surface.clip_lattice())
        if (!(glm::dot(half_space.normal, lattice) >= half_space.offset - 2.0 * coordinate_error))
            return false;
    return true;
}

/// The cell that contains a point; outside of the domain, the nearest one.
inline glm::ivec3 cell_at(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice)
{
    return {glm::clamp(lattice, glm::dvec3(0.0), glm::dvec3(surface.volume().cell_shape() - 1))};
}

/// The cell on the inner side of a point on a half-space's plane.
inline glm::ivec3 inner_cell(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, const HalfSpace& half_space,
                             double coordinate_error)
{
    return cell_at(surface, lattice + 2.0 * std::max(plane_margin, coordinate_error) * half_space.normal);
}

/// The side of a point of the domain in a cell, before the solid is clipped. All points of cells that the mask removes
/// are outside.
Side side_in_cell(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error,
                  const glm::ivec3& cell);

/// The same for a point that may be outside of the domain.
inline Side side_of(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error,
                    const glm::ivec3& cell)
{
    return is_in_domain(surface, lattice, coordinate_error) ? side_in_cell(surface, lattice, coordinate_error, cell)
                                                            : Side::outside;
}

/// The side of a point of a plane of the solid in a cell. Errors of up to `coordinate_error` that put it beside the
/// border of the domain are taken back; a plane of the clip has points farther out, too.
inline Side side_on_plane(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error,
                          const glm::ivec3& cell)
{
    const glm::dvec3 in_domain = glm::clamp(lattice, glm::dvec3(0.0), glm::dvec3(surface.volume().cell_shape()));
    if (glm::any(glm::greaterThan(glm::abs(lattice - in_domain), glm::dvec3(coordinate_error))))
        return Side::outside;
    return side_in_cell(surface, in_domain, coordinate_error, cell);
}

/// The same in the cell that contains the point.
inline Side side_of(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error)
{
    return side_of(surface, lattice, coordinate_error, cell_at(surface, lattice));
}

} // namespace isospline
