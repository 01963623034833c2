// Smallest and largest coefficient of every brick of cells.
#pragma once

#include "isospline/shell/brick.h"
#include "isospline/spline/volume.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <vector>

namespace isospline {

/// Bounds of the coefficients that reach the cells of each brick; B-splines are non-negative and sum to one, so they
/// bound f - offset there too. Computed once a volume, read at every change of the level.
class ValueBounds {
public:
    static constexpr int brick_size = isospline::brick_size; ///< cells along an edge of a brick

    struct Range {
        float lower, upper;
        /// Whether both signs of (coefficient - threshold) occur, a coefficient equal to the threshold being above.
        bool straddles(double threshold) const { return lower < threshold && upper >= threshold; }
    };

    explicit ValueBounds(const Volume& volume);

    /// Bricks along x, y, z.
    glm::ivec3 shape() const { return shape_; }
    /// Range of brick (x, y, z), at index x + shape.x * (y + shape.y * z), as for brick_at().
    const std::vector<Range>& ranges() const { return ranges_; }
    std::size_t memory() const { return ranges_.capacity() * sizeof(Range); }

private:
    glm::ivec3 shape_{0};
    std::vector<Range> ranges_;
};

} // namespace isospline
