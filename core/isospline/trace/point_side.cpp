#include "isospline/trace/point_side.h"

#include "isospline/cell/value-inl.h"
#include "isospline/cell/value_error.h"
#include "isospline/spline/degree.h"

#include <algorithm>
#include <cmath>

namespace isospline {

bool is_at_sample(const Volume& volume, const glm::dvec3& lattice, double coordinate_error)
{
    const glm::dvec3 index = lattice - volume.lattice_shift();
    return glm::all(glm::lessThanEqual(glm::abs(index - glm::round(index)), glm::dvec3(coordinate_error)));
}

Side side_in_cell(const IsosurfaceSnapshot& surface, const glm::dvec3& lattice, double coordinate_error,
                  const glm::ivec3& cell)
{
    const Volume& volume = surface.volume();
    if (!surface.kept_cells().contains(cell))
        return Side::outside;
    return dispatch_degree(volume.degree(), [&](auto degree) {
        // The range of the brick's coefficients decides for most points.
        const BrickRanges::Range range = surface.shared_ranges()->brick(cell / brick_size);
        const double lower = static_cast<double>(range.lower) - surface.threshold();
        const double upper = static_cast<double>(range.upper) - surface.threshold();
        const double of_brick =
            value_error<degree>(std::max(std::abs(lower), std::abs(upper)), coordinate_error) +
            sample_error(static_cast<double>(std::max(std::abs(range.lower), std::abs(range.upper))));
        const double sign = surface.inward_sign();
        if (const Side side = side_of(lower - of_brick, upper + of_brick, sign); side != Side::unknown)
            return side;
        const VolumeCell coefficients(volume, surface.threshold(), cell);
        const double value = scalar::value_in_cell<degree>(coefficients, lattice - coefficients.lower);
        // The bound for the brick is enough for most others. There is no branch on the sign: it would be mispredicted.
        if (std::abs(value) > of_brick)
            return static_cast<Side>(sign * value > 0.0);
        double error = value_error<degree>(coefficients, coordinate_error);
        if (volume.interpolates() && is_at_sample(volume, lattice, coordinate_error))
            error += sample_error(largest_magnitude<degree>(CellCoefficients(coefficients, 0.0, cell)));
        return side_of(value - error, value + error, sign);
    });
}

} // namespace isospline
