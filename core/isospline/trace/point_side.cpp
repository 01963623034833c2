#include "isospline/trace/point_side.h"

#include "isospline/cell/value-inl.h"
#include "isospline/cell/value_error.h"
#include "isospline/spline/degree.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

namespace {

/// The cell that contains a point; outside of the domain, the nearest one.
glm::ivec3 cell_at(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice)
{
    return {glm::clamp(lattice, glm::dvec3(0.0), glm::dvec3(surface.volume().cell_shape() - 1))};
}

} // namespace

Side side_of(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error,
             const glm::ivec3& cell)
{
    const Volume& volume = surface.volume();
    const glm::ivec3 shape = volume.cell_shape();
    for (int axis = 0; axis < 3; ++axis)
        if (!(lattice[axis] >= -coordinate_error && lattice[axis] <= shape[axis] + coordinate_error))
            return Side::outside;
    if (!surface.kept_cells().contains(cell))
        return Side::outside;
    const double sign = surface.inward_sign();
    return dispatch_degree(volume.degree(), [&](auto degree) {
        // The range of the brick's coefficients decides for most points.
        const BrickRanges::Range range = surface.shared_ranges()->brick(cell / brick_size);
        const double lower = sign * (static_cast<double>(range.lower) - surface.threshold());
        const double upper = sign * (static_cast<double>(range.upper) - surface.threshold());
        const double largest = std::max(std::abs(lower), std::abs(upper));
        const double of_brick = value_error<degree>(largest, coordinate_error);
        const Side side = side_of(std::min(lower, upper) - of_brick, std::max(lower, upper) + of_brick);
        if (side != Side::unknown)
            return side;
        const VolumeCell coefficients(volume, surface.threshold(), cell);
        const double inward = sign * scalar::value_in_cell<degree>(coefficients, lattice - coefficients.lower);
        const double error = value_error<degree>(coefficients, coordinate_error);
        return side_of(inward - error, inward + error);
    });
}

Side side_of(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error)
{
    return side_of(surface, lattice, coordinate_error, cell_at(surface, lattice));
}

glm::ivec3 inner_cell(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, const HalfSpace& half_space)
{
    return cell_at(surface, lattice + 2.0 * plane_margin * half_space.normal);
}

bool is_in_clip(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error)
{
    return std::all_of(surface.clip_lattice().begin(), surface.clip_lattice().end(), [&](const HalfSpace& half_space) {
        return glm::dot(half_space.normal, lattice) >= half_space.offset - 2.0 * coordinate_error;
    });
}

double coordinate_error(const glm::dmat4& map, const glm::dvec3& point)
{
    double size = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        double terms = std::abs(map[3][axis]);
        for (int column = 0; column < 3; ++column)
            terms += std::abs(map[column][axis] * point[column]);
        size = std::max(size, terms);
    }
    return 8.0 * 0x1p-53 * size;
}

} // namespace isospline
